"""What a run says of itself: changes of faults, how often each came, and the figures of its end."""

import json
import math

import pytest
from msgspec.structs import replace

from control.notes.run_notes import RunNotes, outcome
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
    flicker = [(Mode.PUSHING, ("F52",)) if k % 2 else (Mode.PUSHING, ()) for k in range(600)]
    notes = noted(*flicker)
    assert len(notes.events) == 200
    assert notes.fault_counts == {"F52": 300}


def test_times_are_given_to_the_millisecond():
    bench, notes = pushing(), RunNotes()
    bench.fold()
    notes.note(bench.inp, bench.state, bench.output)
    later = replace(bench.inp, now_ns=bench.inp.now_ns + 12_345_678)
    notes.note(later, bench.state, replace(bench.output, faults=("F52",)))
    assert notes.events[-1]["t_s"] == 0.012


def test_the_course_of_the_push_is_part_of_the_notes():
    bench, notes = pushing(), RunNotes()
    for lateral_m in (0.02, -0.07, 0.01):
        control = replace(bench.state.control, phase=int(Phase.PUSH), lateral_m=lateral_m)
        notes.note(bench.inp, replace(bench.state, control=control), bench.output)
    assert (notes.figures()["start_lateral_m"], notes.figures()["worst_lateral_m"]) == (0.02, -0.07)


def test_the_first_fault_has_its_value_and_its_time_since_the_first_tick():
    bench = pushing()
    bench.fold()
    safety = replace(
        bench.state.safety, first_fault="F50", first_value=163.0, first_ns=2_000_000_000, first_fault_ns=14_400_000_000
    )
    found = outcome(bench.inp, replace(bench.state, safety=safety), bench.output)
    assert (found["first_fault"], found["first_value"]) == ("F50", 163.0)
    assert found["first_fault_s"] == pytest.approx(12.4)
    unknown = replace(safety, first_value=math.nan)
    assert outcome(bench.inp, replace(bench.state, safety=unknown), bench.output)["first_value"] is None
    none = replace(safety, first_fault="", first_fault_ns=0)
    assert outcome(bench.inp, replace(bench.state, safety=none), bench.output)["first_fault_s"] is None


def test_joints_that_are_no_numbers_are_none():
    bench = pushing()
    bench.fold()
    joints = replace(bench.inp.arm.joints, position=(0.5, math.nan, 1.5, -0.25, math.inf, 2.0))
    inp = replace(bench.inp, arm=replace(bench.inp.arm, joints=joints))
    assert outcome(inp, bench.state, bench.output)["joints_rad"] == [0.5, None, 1.5, -0.25, None, 2.0]


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
