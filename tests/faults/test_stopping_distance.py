"""How far the base rolls on in the emulated world after a blow: never further than was computed before the run.

`pytest -s` prints what was measured. A round that the host stalled is repeated, as in `kill_rounds`.
"""

from __future__ import annotations

import math
import signal
from itertools import pairwise

import pytest

from robot_io.log.world_messages import STATE_CDR
from safety.faults import FAULTS
from safety.stopping import alone_m, of_row
from tests.faults.kill_rounds import STALL_MS, Round, strike
from tests.host_watch import REPEATS, UNMEASURED, HostStalled
from tests.push_runs import messages, stands

KILL, STOP, INT = signal.SIGKILL, signal.SIGSTOP, signal.SIGINT
RAMP = 1.0
"""limits.max_acceleration_m_per_s2 of the rig."""

BLOWS = [
    ("launcher", INT, "F64"),
    ("control", KILL, "F65"),
    ("control", STOP, "F66"),
    ("gate", KILL, "F67"),
    ("gate", STOP, "F67-late"),
    ("arm", KILL, "F69"),
    ("arm", STOP, "F24-stop"),
    ("control gate", KILL, ""),
]
"""Who is struck by what, and the row that must answer; "": nobody is left to send a zero."""


def rolled_m(found: Round) -> float:
    """Return the way of the base from the blow to rest, in m."""
    states = [STATE_CDR.decode(message.payload) for message in messages(found.folder / "run.mcap", "/world/state")]
    before = [state for state in states if state.t_ns <= found.struck_ns][-1]
    way = [(before.base.x, before.base.y)]
    for state in states:
        if state.t_ns > found.struck_ns:
            way.append((state.base.x, state.base.y))
            if stands(state.velocity):
                break
    whole = sum(math.dist(a, b) for a, b in pairwise(way))
    already_s = (found.struck_ns - before.t_ns) * 1e-9
    return whole - already_s * math.hypot(before.velocity.vx, before.velocity.vy)


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.1, 0.3, 0.5])
@pytest.mark.parametrize(("name", "number", "row"), BLOWS, ids=[f"{number.name} {name}" for name, number, _ in BLOWS])
def test_it_rolls_no_further_than_computed(state, tmp_path, host, name, number, row, speed):
    computed = (of_row(FAULTS[row], speed, RAMP) if row else None) or alone_m(speed)
    for attempt in range(1 + REPEATS):
        try:
            found = strike(state, tmp_path / f"run{attempt}", name, number, host, speed=speed)
        except HostStalled as stalled:
            print(f"{number.name} of {name}, round {attempt + 1}: repeated: {stalled}")
            continue
        measured = rolled_m(found)
        told = f"{number.name} of {name} at {speed:g} m/s: {measured * 1e3:.1f} of {computed * 1e3:.1f} mm"
        print(f"{told}, host held back {found.stall_ms:.1f} ms")
        assert found.rest_ms is not None, "the wheels never stood"
        if measured <= computed:
            return
        assert found.stall_ms > STALL_MS, told
    UNMEASURED.add(f"{number.name} of {name} at {speed:g} m/s: within {computed * 1e3:.1f} mm")
