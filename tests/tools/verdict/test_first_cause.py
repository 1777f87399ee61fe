"""The first cause in words: its row, its number, when, and its limit."""

import pytest

from robot_io.rig.config import load_rig
from safety.gate import Latch
from tools.terminal.verdict import cause_words
from tools.verdict.first_cause import FirstFault, fault_words, first_fault, with_dead_emulators

RIG = load_rig("emulated")


def found(fault, value, at_s, latch_cause=0):
    return first_fault(
        RIG, {"first_fault": fault, "first_value": value, "first_fault_s": at_s, "latch_cause": latch_cause}
    )


def test_row_number_time_and_limit_of_the_rig():
    first = found("F50-stop", 163.2, 12.41)
    assert first == FirstFault("F50-stop", 163.2, 150.0, "N", 12.41)
    assert first.words() == "F50-stop the force is above the limit: 163 N at 12.4 s, limit 150 N"


def test_nothing_stopped_a_run_that_went_well():
    assert found("", None, None) is None


@pytest.mark.parametrize(
    ("latch", "fault"),
    [
        (Latch.SILENCE, "F66"),
        (Latch.EOF_MOVING, "F65"),
        (Latch.OVERSPEED, "F35"),
        (Latch.LINK, "F30"),
        (Latch.PAUSED, "F67"),
        (Latch.NONE, "F67"),
    ],
)
def test_behind_a_latch_of_the_gate_stands_the_gates_own_reason(latch, fault):
    assert found("F67", None, 3.0, int(latch)).id == fault


def test_a_row_without_a_measurement_says_when_and_no_number():
    assert found("F64", None, 3.21).words() == "F64 the operator asked for a stop at 3.2 s"
    assert found("F33", 0.0734, 2.0).words() == "F33 the base ignores the command: 0.0734 m/s at 2.0 s"


@pytest.mark.parametrize(
    ("value", "limit", "said"),
    [
        (163.24, 150.0, "163 N, limit 150 N"),
        (150.04, 150.0, "150.04 N, limit 150 N"),
        (5.6, 5.0, "5.6 N, limit 5 N"),
        (12345.6, 5000.0, "12346 N, limit 5000 N"),
    ],
)
def test_number_and_limit_differ_in_print_too(value, limit, said):
    assert fault_words("F50-stop", value, limit, "N") == f"F50-stop the force is above the limit: {said}"


def test_a_number_that_is_not_known_is_left_out():
    assert fault_words("F02", float("nan"), None, "") == "F02 the force sensor's link is gone"


def test_consequences_are_left_out_and_what_asked_for_more_is_said():
    hold = FirstFault("F24-hold", 52.0, 40.0, "ms", 2.0)
    said = "F24-hold no arm record for 40 ms: 52 ms at 2.0 s, limit 40 ms"
    assert cause_words(hold, ["F24-hold", "F01-hold", "F60-late"]) == said
    assert cause_words(hold, ["F64", "F24-hold"]) == f"{said}; then F64 the operator asked for a stop"


def stopped_at(first_s, *, exit_code=5):
    """Return figures of a run whose first tick was at 100 s on the machine's clock."""
    return {
        "first_tick_ns": 100 * 10**9, "first_fault": "F02", "first_value": 3.0, "first_fault_s": first_s,
        "exit_code": exit_code, "latch_cause": 0,
    }  # fmt: skip


def test_emulators_that_died_first_are_the_cause_and_what_fell_silent_with_them_is_not():
    for first_s in (7.3, 6.9, 8.1):  # the launcher may learn of it a little later than control sees what follows
        first = first_fault(RIG, with_dead_emulators(stopped_at(first_s), 107 * 10**9))
        assert first.id == "emulators"
        assert first.words() == (
            f"the emulators have ended, and with them every emulated device at {min(first_s, 7.0):.1f} s"
        )


def test_a_stop_before_the_emulators_died_keeps_its_own_cause():
    assert first_fault(RIG, with_dead_emulators(stopped_at(3.0), 107 * 10**9)).id == "F02"
    assert first_fault(RIG, with_dead_emulators(stopped_at(3.0), 0)).id == "F02"
    assert with_dead_emulators(stopped_at(None, exit_code=0), 107 * 10**9)["first_fault_s"] is None
