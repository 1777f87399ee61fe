"""`push bench latency`: how one step of the force is followed through a log, and what a whole run gives."""

from __future__ import annotations

import json

import pytest
from msgspec.structs import replace

from robot_io.log.world_messages import WorldCommand
from robot_io.messages import BaseRecord, BodyTwist, LinkState
from robot_io.tick import ControlTick, FtInput, FtReading, HostInput, TickInput, TickOutput, TickState
from tests.safety.fold_bench import FoldBench
from tools.bench.latency import STAGES, Step, follow, summed_up
from tools.cli import main

US = 1_000
PRESSED_NS = 1_000_000_000


def twist(at: int) -> BodyTwist:
    """Return the command of a tick: each its own."""
    return BodyTwist(0.1, 0.001 * at, 0.0)


def ticks(of_two: int = 0) -> list[ControlTick]:
    """Return ticks of 10 ms around the press, 3 ms beside it, that wake up 100 us late and read in 20.

    The gate sends every other command. A packet comes 6 ms after each tick's deadline; from the press on its force is
    8 N.
    """
    good, made = FoldBench().good_input(), []
    sent = BaseRecord()
    for at in range(-8, 9):
        deadline_ns = PRESSED_NS + 10_000 * US * at + 3_000 * US
        received_ns = deadline_ns - 4_000 * US
        force = (0.0, 8.0 if received_ns >= PRESSED_NS + 7_000 * US else 0.0, 0.0)
        reading = FtReading(received_ns, at + 8, force, (0.0, 0.0, 0.0))
        inp = replace(
            good,
            now_ns=deadline_ns + 120 * US,
            host=HostInput(100 * US, 0, True, True, True, False, 0),
            ft=FtInput((reading,), LinkState.UP, at + 8, 0, 0),
            base=sent,
        )
        made.append(tick(inp, twist(at)))
        if at % 2 == of_two:
            sent = BaseRecord(sent=twist(at), sent_ns=deadline_ns + 400 * US)
    return made


def tick(inp: TickInput, command: BodyTwist) -> ControlTick:
    output = TickOutput(2, (), BodyTwist(), BodyTwist(), command, 0.0, 0.0, False, 0)  # type: ignore[arg-type]
    return ControlTick(0, 0, inp, (), TickState(), output)


def arrivals(of_two: int = 0) -> list[WorldCommand]:
    """Return the commands at the base, 0.3 ms after they have left."""
    return [
        WorldCommand(PRESSED_NS + (10_000 * at + 3_700) * US, twist(at), False, True) for at in range(of_two - 8, 9, 2)
    ]


def test_a_step_is_followed_from_the_hand_to_the_base():
    """Packets at 9 and 19 ms, ticks at 13 and 23 ms; the gate sends the command of the tick at 23 ms, its second."""
    step = follow(PRESSED_NS, ticks(), arrivals(), 20 * US)
    assert step is not None
    assert [round((at - PRESSED_NS) / US) for at in step] == [0, 9_000, 19_000, 23_000, 23_000, 23_400, 23_700]
    assert step.stages() == pytest.approx(
        {
            "sensor_us": 9_000,
            "median_us": 10_000,
            "tick_us": 4_000,
            "slot_us": 0,
            "command_us": 400,
            "wire_us": 300,
            "total_us": 23_700,
            "software_us": 700,
        }
    )


def test_a_command_that_has_to_wait_for_its_turn_waits_a_tick():
    """The gate sends the commands of the ticks at 13 and 33 ms: the second one has to do."""
    step = follow(PRESSED_NS, ticks(of_two=1), arrivals(of_two=1), 20 * US)
    assert step is not None
    found = step.stages()
    assert (found["tick_us"], found["slot_us"], found["command_us"], found["total_us"]) == (4_000, 10_000, 400, 33_700)


def test_what_cannot_be_followed_is_none():
    assert follow(PRESSED_NS, [], arrivals(), 0) is None
    assert follow(PRESSED_NS, ticks(), [], 0) is None
    assert follow(PRESSED_NS - 2 * 10**9, ticks(), arrivals(), 0) is None
    flat = [replace(one, input=replace(one.input, ft=FtInput((), LinkState.UP, 0, 0, 0))) for one in ticks()]
    assert follow(PRESSED_NS, flat, arrivals(), 0) is None


def test_a_hundred_steps_are_summed_up():
    steps = [Step(0, *([1_000 * i] * 6)) for i in range(1, 101)]
    found = summed_up([step.stages() for step in steps])
    assert list(found) == list(STAGES)
    assert found["sensor_us"] == (50.5, 100)
    assert found["wire_us"] == (0, 0)


@pytest.mark.long
def test_a_whole_run_is_measured(capsys):
    assert main(["bench", "latency", "--steps", "8", "--json"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["asked"] == 8
    assert 4 <= found["steps"] <= 8
    stages = {name: one["p50"] for name, one in found["stages"].items()}
    assert set(stages) == set(STAGES)
    assert min(stages.values()) >= 0
    assert 10_000 < stages["total_us"] < 100_000
    assert 9_000 < stages["median_us"] < 12_000  # the next packet of a sensor of 100 Hz
