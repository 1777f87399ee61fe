"""`done` only where no evidence speaks against it: each piece of evidence at its limit and beyond."""

from datetime import UTC, datetime

import pytest

from robot_io.rig.config import load_rig
from tools.verdict.evidence import TrustItem, gather
from tools.verdict.judgement import judge
from tools.verdict.witness import Witness

GOOD = {
    "exit_code": 0,
    "distance_m": 2.0,
    "start_lateral_m": 0.05,
    "worst_lateral_m": -0.1,
    "lateral_error_m": 0.02,
    "lost_m": 0.0,
    "lost_times": 0,
    "early_contact": False,
    "force_before_contact_N": 0.3,
    "residual_N": 0.4,
    "log_dropped": 0,
    "faults": [],
    "fault_counts": {},
}


def judged(*overrides, witness=None, **figures):
    """Return the verdict on a run, and what speaks against it."""
    found = {**GOOD, **figures}
    trust = gather(load_rig("emulated", overrides), found, witness or Witness(unanswered=0))
    verdict = judge(found["exit_code"], trust)
    return (*verdict, [item.id for item in trust if item.says == "against"])


def test_a_good_push_is_done_and_every_question_was_asked():
    trust = gather(load_rig("emulated"), GOOD, Witness(unanswered=0))
    assert judge(0, trust) == ("done", 0)
    assert [item.id for item in trust] == [
        "corridor", "end", "contact_lost_m", "contact_lost_times", "early_contact", "force_before_contact",
        "residual", "log", "log_dropped", "preflight"
    ]  # fmt: skip
    assert {item.says for item in trust} == {"for"}


@pytest.mark.parametrize(
    ("figures", "id_"),
    [
        ({"worst_lateral_m": -0.5}, None),
        ({"worst_lateral_m": -0.501}, "corridor"),
        ({"worst_lateral_m": 0.501}, "corridor"),
        ({"worst_lateral_m": 0.3, "lateral_error_m": 0.3}, None),
        ({"worst_lateral_m": 0.301, "lateral_error_m": 0.301}, "end"),
        ({"worst_lateral_m": -0.301, "lateral_error_m": -0.301}, "end"),
    ],
)
def test_corridor_and_tolerance_are_the_papers_and_both_sides_count(figures, id_):
    want = ("done", 0, []) if id_ is None else ("off the line", 9, [id_])
    assert judged(**figures) == want


def test_the_rig_sets_corridor_and_tolerance():
    assert judged("goal.corridor_m=0.08") == ("off the line", 9, ["corridor"])
    assert judged("goal.end_tolerance_m=0.01") == ("done", 0, [])  # it began 0.05 m off
    assert judged("goal.end_tolerance_m=0.01", start_lateral_m=0.0) == ("off the line", 9, ["end"])


def test_a_push_that_starts_further_off_may_end_as_far_off():
    off = {"start_lateral_m": -0.45, "worst_lateral_m": -0.46}
    assert judged(**off, lateral_error_m=0.45) == ("done", 0, [])
    assert judged(**off, lateral_error_m=0.46) == ("off the line", 9, ["end"])


@pytest.mark.parametrize(
    ("figures", "id_"),
    [
        ({"residual_N": 5.0}, None),
        ({"residual_N": 5.01}, "residual"),
        ({"lost_m": 0.2}, None),
        ({"lost_m": 0.201}, "contact_lost_m"),
        ({"lost_times": 5}, None),
        ({"lost_times": 6}, "contact_lost_times"),
        ({"early_contact": True}, "early_contact"),
        ({"force_before_contact_N": 3.0}, None),
        ({"force_before_contact_N": 3.01}, "force_before_contact"),
        ({"force_before_contact_N": None}, None),
        ({"log_dropped": 1}, "log_dropped"),
        ({"faults": ["F73-hold"], "fault_counts": {"F73-hold": 1}}, "launcher"),
    ],
)
def test_what_makes_a_run_untrustworthy(figures, id_):
    want = ("done", 0, []) if id_ is None else ("not trusted", 9, [id_])
    assert judged(**figures) == want


@pytest.mark.parametrize(
    ("witness", "id_"),
    [
        (Witness(log="the recorder process was killed by SIGKILL"), "log"),
        (Witness(records_missing=3), "log_dropped"),
        (Witness(gate="the gate process was killed by SIGSEGV"), "gate"),
    ],
)
def test_what_the_other_processes_say_counts(witness, id_):
    assert judged(witness=witness) == ("not trusted", 9, [id_])


def test_who_is_not_trusted_is_not_said_to_be_off_the_line():
    assert judged(residual_N=6.0, lateral_error_m=0.4)[:2] == ("not trusted", 9)


@pytest.mark.parametrize(
    ("code", "verdict"),
    [(1, "error"), (4, "not ready"), (5, "safety stop"), (6, "contact lost"), (130, "operator stop")],
)
def test_a_failure_stays_what_it_is(code, verdict):
    assert judged(exit_code=code, residual_N=6.0, lateral_error_m=0.4, log_dropped=2)[:2] == (verdict, code)


def unknown(*overrides, witness=None, **figures):
    trust = gather(load_rig("emulated", overrides), {**GOOD, **figures}, witness or Witness())
    assert judge(0, trust) == ("done", 0)
    return [item.id for item in trust if item.says == "unknown"]


def test_what_is_not_known_speaks_neither_for_nor_against():
    assert unknown() == []
    assert unknown(residual_N=None) == ["residual"]
    assert unknown(fault_counts={"F73-hold": 2}) == ["launcher"]
    assert unknown(witness=Witness(unanswered=2)) == ["preflight"]
    assert unknown("base.pose_source=odometry") == ["pose"]
    assert unknown(start_lateral_m=None, worst_lateral_m=None, distance_m=0.0) == ["corridor", "end"]


def test_an_item_has_its_number_beside_its_limit():
    trust = {item.id: item for item in gather(load_rig("emulated"), {**GOOD, "residual_N": 5.6}, Witness())}
    assert trust["residual"] == TrustItem(
        "residual", "against", 5.6, 5.0, "N", "the sensor reads 5.60 N out of contact after the push, limit 5 N"
    )
    assert (trust["corridor"].value, trust["corridor"].limit, trust["corridor"].unit) == (0.1, 0.5, "m")
    assert (trust["end"].value, trust["end"].limit) == (0.02, 0.3)
    assert (trust["contact_lost_m"].value, trust["contact_lost_m"].limit) == (0.0, 0.2)


CALIBRATED = (
    *("calibration.frame.made=2026-07-01T00:00:00Z", "calibration.frame.uncertainty=1", "calibration.frame.unit=deg"),
    *("calibration.contact.made=2026-07-20T00:00:00Z", "calibration.contact.uncertainty=1"),
    "calibration.contact.unit=m",
)


@pytest.mark.parametrize(("day", "says"), [(30, "for"), (31, "for"), (32, "unknown")])
def test_a_calibration_older_than_its_rig_allows_is_unknown_and_never_against(day, says):
    """30 days: one of the 1st is too old after the 31st."""
    ended = datetime(2026, 7, 30, tzinfo=UTC).timestamp() + (day - 30) * 86400
    trust = gather(load_rig("emulated", CALIBRATED), GOOD, Witness(unanswered=0), ended)
    [item] = [item for item in trust if item.id == "calibration"]
    assert (item.says, item.value, item.limit, item.unit) == (says, day - 1, 30.0, "days")
    assert judge(0, trust) == ("done", 0)
    assert (item.text == "the sensor's frame was calibrated 31 days ago") == (says == "unknown")


def test_a_rig_that_names_no_calibration_is_not_asked_for_its_age():
    trust = gather(load_rig("emulated"), GOOD, Witness(), 1e9)
    assert "calibration" not in [item.id for item in trust]
    some = gather(load_rig("emulated", CALIBRATED[3:]), GOOD, Witness(), datetime(2026, 7, 21, tzinfo=UTC).timestamp())
    assert [(item.says, item.text) for item in some if item.id == "calibration"] == [
        ("unknown", "never calibrated: the sensor's frame")
    ]
