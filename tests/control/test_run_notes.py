"""What a run says of itself: changes of faults, how often each came, and the figures of its end."""

import json
import math

import pytest
from msgspec.structs import replace

from control.notes.run_notes import MOST_EVENTS, RunNotes, outcome
from robot_io.messages import Pose2D
from robot_io.tick import ControlState, Mode, Phase, TickState
from tests.safety.fold_bench import PERIOD_NS, FoldBench, pushing


def noted(*ticks):
    """Note (mode, faults) tick by tick."""
    bench, notes = pushing(), RunNotes()
    bench.fold()
    for k, (mode, faults) in enumerate(ticks):
        inp = replace(bench.inp, tick=100 + k, now_ns=bench.inp.now_ns + k * PERIOD_NS)
        notes.note(inp, bench.state, replace(bench.output, mode=int(mode), faults=faults))
    return notes


def test_only_changes_are_noted_and_each_coming_is_counted():
    notes = noted(
        (Mode.PUSHING, ()), (Mode.SLOW, ("F40-slow",)), (Mode.SLOW, ("F40-slow",)), (Mode.SLOW, ()),
        (Mode.PUSHING, ()), (Mode.HOLD, ("F40-slow", "F01-hold")),
    )  # fmt: skip
    assert notes.fault_counts == {"F40-slow": 2, "F01-hold": 1}
    assert [(e["tick"], e["mode"], e["faults"]) for e in notes.events] == [
        (101, "SLOW", ["F40-slow"]),
        (103, "SLOW", []),
        (105, "HOLD", ["F40-slow", "F01-hold"]),
    ]
    assert [e["t_s"] for e in notes.events] == [0.01, 0.03, 0.05]


def test_the_notes_are_bounded_and_the_counts_go_on():
    flicker = [(Mode.PUSHING, ("F52",)) if k % 2 else (Mode.PUSHING, ()) for k in range(3 * MOST_EVENTS)]
    notes = noted(*flicker)
    assert len(notes.events) == MOST_EVENTS
    assert notes.fault_counts == {"F52": 3 * MOST_EVENTS // 2}


@pytest.mark.parametrize("phase", list(Phase))
def test_the_figures_of_the_end(phase):
    bench = pushing()
    bench.fold()
    control = ControlState(
        phase=int(phase), progress_m=1.5, lateral_m=0.25, end_progress_m=2.0, end_lateral_m=-0.125, tared=True
    )
    found = outcome(bench.inp, TickState(control), bench.output)
    # After the rest that ends a push, what counts is where it ended, not where the retreat has gone since.
    over = phase in (Phase.RETREAT, Phase.CHECK, Phase.DONE, Phase.FAILED)
    assert (found["distance_m"], found["lateral_error_m"]) == ((2.0, -0.125) if over else (1.5, 0.25))
    assert found["residual_N"] is None
    assert found["phase"] == phase.name
    checked = outcome(bench.inp, TickState(replace(control, residual_N=0.5)), bench.output)
    assert checked["residual_N"] == 0.5
    assert not math.isnan(checked["residual_N"])


def test_a_run_that_never_had_a_pose_still_has_figures_that_are_numbers():
    """A mocap that says null from the start: R01, and a summary that JSON can hold."""
    bench = FoldBench()
    nowhere = Pose2D(math.nan, math.nan, math.nan)
    bench.run_until(
        lambda b: b.output.finished, lambda inp, _: replace(inp, base=replace(inp.base, pose=nowhere, pose_valid=False))
    )
    found = outcome(bench.inp, bench.state, bench.output)
    assert (found["exit_code"], found["faults"]) == (4, ["R01"])
    assert (found["distance_m"], found["lateral_error_m"]) == (0.0, 0.0)
    json.dumps(found, allow_nan=False)
