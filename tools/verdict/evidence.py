"""What is known at the end of a run that speaks for or against it: an item for each question, with its answer."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from robot_io.rig.config import RigConfig
from safety.checks.task_checks import RESIDUAL_N
from tools.verdict.calibration_age import CalibrationAge, calibration_age
from tools.verdict.witness import Witness

MOST_LOST_SHARE = 0.1
"""More of the push without contact than this, and it was not the object that was pushed all the way ..."""
MOST_LOSSES = 5
"""... nor if contact was lost more often than this."""
MOST_FORCE_BEFORE_N = 3.0
"""A mean force above this just before first contact, where it should be 0, is no sensor to measure a contact with."""
LINE = ("corridor", "end")
"""The items that say where the push went; all others say whether it can be believed."""
LAUNCHER = "F73"
"""Family of the rows for a launcher that has fallen silent."""

Says = Literal["for", "against", "unknown"]


class TrustItem(msgspec.Struct, frozen=True):
    """One piece of evidence. value and limit are in `unit`, None where there is none."""

    id: str
    says: Says
    value: float | None
    limit: float | None
    unit: str
    text: str


def gather(rig: RigConfig, figures: dict[str, Any], witness: Witness, ended_s: float | None = None) -> list[TrustItem]:
    """Return the evidence of a run, from its figures (`control.notes.run_notes`) and from what else is known of it.

    ended_s: when it ended, s since the epoch; without it the age of calibrations is no question.
    """
    items = [
        *_line(rig, figures),
        *_contact(figures),
        *_first_contact(figures),
        _residual(figures["residual_N"]),
        _log(witness.log),
        _missing(max(witness.records_missing, figures["log_dropped"])),
    ]
    if witness.gate:
        items.append(_item("gate", "against", witness.gate))
    if any(fault.startswith(LAUNCHER) for fault in figures["faults"]):
        items.append(_item("launcher", "against", "the launcher was silent when the run ended"))
    elif any(fault.startswith(LAUNCHER) for fault in figures["fault_counts"]):
        items.append(_item("launcher", "unknown", "the launcher was silent for a while: no key would have been heard"))
    if witness.unanswered is not None:
        items.append(_preflight(witness.unanswered))
    if rig.base.pose_source == "odometry":
        items.append(_item("pose", "unknown", "the pose is odometry: nothing independent says where the base was"))
    if ended_s is not None and rig.calibration.made():
        items.append(_calibration(calibration_age(rig, ended_s), rig.calibration.max_age_days))
    return items


def _item(
    id_: str, says: Says, text: str, value: float | None = None, limit: float | None = None, unit: str = ""
) -> TrustItem:
    return TrustItem(id_, says, value, limit, unit, text)


def _within(value: float, limit: float) -> Says:
    return "for" if value <= limit else "against"


def _line(rig: RigConfig, figures: dict[str, Any]) -> list[TrustItem]:
    start, worst, end = figures["start_lateral_m"], figures["worst_lateral_m"], figures["lateral_error_m"]
    if start is None:
        return [_item(id_, "unknown", "there was no contact, so nothing was pushed", None, None, "m") for id_ in LINE]
    corridor, tolerance = rig.goal.corridor_m, max(rig.goal.end_tolerance_m, abs(start))
    return [
        _item(
            "corridor",
            _within(abs(worst), corridor),
            f"the ball was at most {abs(worst):.3f} m off the path, corridor {corridor:g} m",
            abs(worst),
            corridor,
            "m",
        ),
        _item(
            "end",
            _within(abs(end), tolerance),
            f"the ball ended {abs(end):.3f} m off the path, tolerance {tolerance:.3g} m",
            abs(end),
            tolerance,
            "m",
        ),
    ]


def _contact(figures: dict[str, Any]) -> list[TrustItem]:
    if figures["start_lateral_m"] is None:
        return []
    lost_m, times, pushed_m = figures["lost_m"], figures["lost_times"], figures["distance_m"]
    limit_m = MOST_LOST_SHARE * max(pushed_m, 0.0)
    return [
        _item(
            "contact_lost_m",
            _within(lost_m, limit_m),
            f"there was no contact over {lost_m:.3f} m of {pushed_m:.2f} m, limit {limit_m:.3f} m",
            lost_m,
            limit_m,
            "m",
        ),
        _item(
            "contact_lost_times",
            _within(times, MOST_LOSSES),
            f"contact was lost {times} times, limit {MOST_LOSSES}",
            times,
            MOST_LOSSES,
        ),
    ]


def _first_contact(figures: dict[str, Any]) -> list[TrustItem]:
    force_N = figures["force_before_contact_N"]
    if force_N is None:
        return []
    early = figures["early_contact"]
    when = "long before the object was expected" if early else "about where the object was expected"
    said = f"the mean force just before first contact was {force_N:.2f} N, limit {MOST_FORCE_BEFORE_N:g} N"
    return [
        _item("early_contact", "against" if early else "for", f"first contact came {when}"),
        _item("force_before_contact", _within(force_N, MOST_FORCE_BEFORE_N), said, force_N, MOST_FORCE_BEFORE_N, "N"),
    ]


def _residual(residual_N: float | None) -> TrustItem:
    if residual_N is None:
        return _item(
            "residual", "unknown", "whether the sensor still reads zero was not checked", None, RESIDUAL_N, "N"
        )
    text = f"the sensor reads {residual_N:.2f} N out of contact after the push, limit {RESIDUAL_N:g} N"
    return _item("residual", _within(residual_N, RESIDUAL_N), text, residual_N, RESIDUAL_N, "N")


def _log(missing: str) -> TrustItem:
    if missing:
        return _item("log", "against", f"the log is not complete: {missing}")
    return _item("log", "for", "the log is complete")


def _missing(records: int) -> TrustItem:
    text = f"{records} records are missing from the log"
    return _item("log_dropped", _within(records, 0), text, records, 0, "records")


def _preflight(unanswered: int) -> TrustItem:
    if not unanswered:
        return _item("preflight", "for", "the base's preflight was answered", 0, 0, "questions")
    text = f"{unanswered} questions of the base's preflight were not answered"
    return _item("preflight", "unknown", text, unanswered, 0, "questions")


def _calibration(age: CalibrationAge, limit: float) -> TrustItem:
    says: Says = "unknown" if age.words else "for"
    text = age.words or "sensor and contact point were calibrated lately"
    return _item("calibration", says, text, age.oldest_days, limit, "days")
