"""How far a Ridgeback's wheels roll on after each fault that stops a push: no further than its row's stopping distance.

The tick's commands go to the emulated wheels 20 ms later, the most that the wire may take; four phases of their tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from robot_io.messages import BodyTwist, Pose2D
from robot_io.tick import Mode
from safety.faults import FAULTS
from safety.stopping import of_row
from sim_backend.world.base_plant import BasePlant
from tests.safety.fault_scenarios import SCENARIOS, Scenario, base
from tests.safety.fold_bench import PERIOD_NS, FoldBench, pushing

WIRE_NS = 20_000_000
PHASES = (0.0, 0.25, 0.5, 0.75)
SILENT = ("F30", "F67", "F67-late")
"""Link or gate is gone: whatever the tick commands, nothing arrives any more."""
PREROLL_NS = 400_000_000
"""Time for the wheels to reach 0.5 m/s."""
LONGEST_TICKS = 400


def way_m(scenario: Scenario, bench: FoldBench, phase: float) -> tuple[float, set[str]]:
    """Return how far the wheels roll from the first tick with the fault to rest, and the rows named until then."""
    start_ns = bench.now_ns - PREROLL_NS
    wheels = BasePlant(Pose2D(), start_ns, tick_phase=phase)
    for at_ns in range(start_ns, bench.now_ns, PERIOD_NS):
        wheels.command(bench.sent, at_ns + WIRE_NS)
        wheels.step_to(at_ns)
    from_m, named = math.nan, set[str]()
    for n in range(scenario.warm + LONGEST_TICKS):
        scenario.before(bench)
        now_ns = bench.now_ns
        wheels.step_to(now_ns)
        if n == scenario.warm:
            from_m = math.hypot(wheels.pose.x, wheels.pose.y)
        command = bench.fold(scenario.alter, n).command_body
        if n < scenario.warm or scenario.row not in SILENT:
            wheels.command(command, now_ns + WIRE_NS)
        named |= set(bench.output.faults)
        over = scenario.row in named or bench.output.mode >= Mode.STOP
        if over and command == wheels.velocity == BodyTwist():
            break
    assert wheels.velocity == BodyTwist(), "it never came to rest"
    return math.hypot(wheels.pose.x, wheels.pose.y) - from_m, named


def judged(scenario: Scenario, start: Callable[[], FoldBench], speed: float) -> None:
    """Compare with the row, or with another that was quicker because its window is a way and not a time."""
    for phase in PHASES:
        way, named = way_m(scenario, start(), phase)
        computed = max(of_row(FAULTS[row], speed, 1.0) or 0.0 for row in {scenario.row, *named})
        print(f"{scenario} at {speed:g} m/s: {way * 1e3:.1f} of {computed * 1e3:.1f} mm")
        assert way <= computed


def stops(scenario: Scenario) -> bool:
    return of_row(FAULTS[scenario.row], 0.1, 1.0) is not None


SLOW_ROWS = ("F45-retreat", "F46-retreat", "F53")
"""Their scenarios are whole pushes."""
STOPPING = [
    pytest.param(s, id=str(s), marks=[pytest.mark.long] if s.row in SLOW_ROWS else []) for s in SCENARIOS if stops(s)
]


@pytest.mark.parametrize("scenario", STOPPING)
def test_at_a_tenth_of_a_metre_a_second(scenario):
    judged(scenario, scenario.start, 0.1)


MADE_FOR_ONE_SPEED = ("F37",)
"""Its scenarios shift the pose by so much a second; at a higher speed that is a smaller share of the way."""


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.3, 0.5])
@pytest.mark.parametrize(
    "scenario",
    [s for s in SCENARIOS if stops(s) and s.start is pushing and s.row not in MADE_FOR_ONE_SPEED],
    ids=str,
)
def test_faster(scenario, speed):
    if scenario.row == "F35":  # its scenarios are too fast for 0.1 m/s
        scenario = replace(scenario, alter=base(odometry=BodyTwist(2.0 * speed, 0.0, 0.0)))
    judged(scenario, lambda: pushing((f"control.push_speed_m_per_s={speed}",)), speed)


def test_every_row_that_stops_is_measured():
    by_the_gate = {"F65", "F66"}
    assert {i for i, row in FAULTS.items() if of_row(row, 0.1, 1.0) is not None} == by_the_gate | {
        s.row for s in SCENARIOS if stops(s)
    }
