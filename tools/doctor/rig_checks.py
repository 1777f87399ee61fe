"""The rows of the rig itself: room, corridor, stopping distance, gains, calibration. Nothing is opened."""

from __future__ import annotations

import time

from robot_io.errors import PushError, UsageError
from robot_io.rig.config import RigConfig
from robot_io.rig.world import TruthConfig
from safety.faults import FAULTS
from safety.stopping import stopping
from safety.workspace import SPARE_AHEAD_M, SPARE_AROUND_M, WorkspaceSettings
from tools.doctor.check import Check, Rows
from tools.rig import devices_at
from tools.run.facts.bounds import check_room, stopping_line, workspace_line
from tools.terminal.gain_warning import gain_margin, gain_warning
from tools.verdict.calibration_age import calibration_age


def rig_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of the rig."""
    rows = Rows("rig")
    _workspace(rows, rig)
    _corridor(rows, rig)
    _stopping(rows, rig)
    _gains(rows, rig)
    _calibration(rows, rig)
    return rows.all("not looked at")


def _workspace(rows: Rows, rig: RigConfig) -> None:
    told = workspace_line(rig)
    try:
        check_room(rig, 0)
    except UsageError as error:
        rows.bad("workspace", "failed", error.what, error.do)
        return
    if rig.base.level == "hardware" and not rig.workspace.corners:
        rows.bad("workspace", "warning", told, "Give `[workspace]` in the rig: where base and object may be")
    else:
        rows.ok("workspace", told)


def _corridor(rows: Rows, rig: RigConfig) -> None:
    """Judge whether the ball may leave the path as far as the goal allows before the base leaves its floor."""
    settings, corridor_m = WorkspaceSettings.of(rig), rig.goal.corridor_m
    told = f"the ball may be {corridor_m:g} m beside the path, {rig.goal.end_tolerance_m:g} m at its end"
    if rig.goal.end_tolerance_m > corridor_m:
        rows.bad("corridor", "warning", f"{told}: more than on the way", "Lower goal.end_tolerance_m", corridor_m)
        return
    if not settings.given:
        rows.ok("corridor", told, corridor_m, SPARE_AROUND_M, "m")
        return
    beside_m = _beside_m(settings)
    told += f"; the workspace leaves the base {beside_m:.2f} m beside it"
    if corridor_m <= beside_m:
        rows.ok("corridor", told, corridor_m, beside_m, "m")
    else:
        fix = "Lower goal.corridor_m or widen the workspace: a push may be stopped (F55) that its goal would allow"
        rows.bad("corridor", "warning", told, fix, corridor_m, beside_m, "m")


def _beside_m(settings: WorkspaceSettings) -> float:
    """Return how far beside the path the base's middle may be anywhere in the workspace, on its narrower side."""
    lateral = [settings.path.lateral(*corner) for corner in settings.given]
    return min(max(lateral), -min(lateral)) - settings.half_width


def _stopping(rows: Rows, rig: RigConfig) -> None:
    found = stopping(rig, FAULTS.values())
    told = stopping_line(found)
    if found.slowest_m <= SPARE_AHEAD_M:
        rows.ok("stopping-distance", told, found.slowest_m, SPARE_AHEAD_M, "m")
    else:
        fix = "Lower control.push_speed_m_per_s"
        rows.bad("stopping-distance", "warning", told, fix, found.slowest_m, SPARE_AHEAD_M, "m")


def _gains(rows: Rows, rig: RigConfig) -> None:
    try:
        warning, margin = gain_warning(rig), gain_margin(rig)
    except PushError as error:
        rows.error("gains", error)
        return
    gains = f"{rig.control.k_f:g}/{rig.control.k_y_rad_per_m:g}"
    if warning:
        rows.bad("gains", "warning", warning, "`push tune` finds better ones", rig.control.k_y_rad_per_m, None, "rad/m")
    else:
        judged = f": k_y is {margin.words}" if margin else ""
        told = f"{gains} with margin for the sliders of this rig{judged}"
        limit = margin.limit_rad_per_m if margin else None
        rows.ok("gains", told, rig.control.k_y_rad_per_m, limit, "rad/m")


def _calibration(rows: Rows, rig: RigConfig) -> None:
    if devices_at(rig, "sim") and rig.world.truth == TruthConfig():
        rows.skip("calibration-age", "the frames of level sim are exact")
        return
    age, limit = calibration_age(rig, time.time()), rig.calibration.max_age_days
    if not age.words:
        told = f"calibrated: {', '.join(rig.calibration.made())}"
        rows.ok("calibration-age", told, age.oldest_days, limit, "days")
        return
    fix = "`push calibrate` measures them: one degree of the sensor costs about a decimetre beside the path"
    rows.bad("calibration-age", "warning", age.words, fix, age.oldest_days, limit, "days")
