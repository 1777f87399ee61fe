"""What bounds the motion of a run, computed before it: in numbers for log and summary, in words for people."""

from __future__ import annotations

from typing import Any

import msgspec

from robot_io.errors import UsageError
from robot_io.messages import Pose2D
from robot_io.polygon import longest_line_m
from robot_io.rig.config import RigConfig
from safety.faults import FAULTS
from safety.motion_bounds import TravelLimits, in_words, phase_bounds, total_bounds
from safety.stopping import Stopping, stopping
from safety.workspace import SPARE_AROUND_M, WorkspaceSettings, room_for_push
from sim_backend.world.scene import place

FURTHEST_WITHOUT_WORKSPACE_M = 10.0
"""A real base is not pushed further than this by a rig that does not say where it may be."""


def bounds_of(rig: RigConfig) -> dict[str, Any]:
    """Return what bounds a run of this rig.

    `motion`, `phases` (m, s), `stopping` (m at m/s), `workspace` (m, WORLD), `pose`.
    """
    workspace = WorkspaceSettings.of(rig)
    return {
        "motion": {**msgspec.to_builtins(total_bounds(rig)), "phases": msgspec.to_builtins(phase_bounds(rig))},
        "stopping": msgspec.to_builtins(stopping(rig, FAULTS.values())),
        "workspace": {
            "given": bool(workspace.given),
            "corners_m": [list(corner) for corner in workspace.given],
            "around_path_m": None if workspace.given else SPARE_AROUND_M,
            "base_outline_m": list(rig.base.outline_m),
        },
        "pose": {"source": rig.base.pose_source, "checked_against_odometry": rig.base.pose_source != "odometry"},
    }


def bounds_lines(rig: RigConfig) -> list[str]:
    """Return what is said of the bounds at the start of a run."""
    lines = [
        _motion_line(total_bounds(rig)),
        in_words(phase_bounds(rig)),
        workspace_line(rig),
        stopping_line(stopping(rig, FAULTS.values())),
    ]
    if rig.base.pose_source == "odometry":
        lines.append("the pose is odometry, so it cannot be checked against it")
    return lines


def check_room(rig: RigConfig, seed: int) -> None:
    """Raise UsageError where the wanted distance is known not to fit, before anything is opened."""
    workspace = WorkspaceSettings.of(rig)
    distance_m = rig.control.distance_m
    if not workspace.given:
        if rig.base.level == "hardware" and distance_m > FURTHEST_WITHOUT_WORKSPACE_M:
            raise UsageError(
                f"a real base is not moved {distance_m:g} m (more than {FURTHEST_WITHOUT_WORKSPACE_M:g} m) without a "
                "workspace",
                where="push run",
                do="Give `[workspace]` in the rig, or a shorter --distance-m",
            )
        return
    start, slider = _start(rig, seed)
    if start is not None:
        left = room_for_push(workspace, start, slider)
    else:  # known once it is measured (R06); the longest line in the workspace is too short in any case
        left = longest_line_m(workspace.given) - workspace.approach_m - distance_m - 2.0 * workspace.half_width
    if left < 0.0:
        raise UsageError(
            f"a push of {distance_m:g} m does not fit into the rig's workspace: {-left:.2f} m of room are missing",
            where="push run",
            do="Give a shorter --distance-m, another start, or correct `[workspace]`",
        )


def _start(rig: RigConfig, seed: int) -> tuple[Pose2D | None, Pose2D | None]:
    """Return where base and object will be seen at the start, as far as that is known before it."""
    if rig.base.pose_source == "odometry":  # counted from where it starts
        return Pose2D(), None
    if rig.base.level == "hardware":
        return None, None
    scene = place(rig, seed)
    return scene.base, scene.slider if WorkspaceSettings.of(rig).object_seen else None


def _motion_line(most: TravelLimits) -> str:
    return (
        f"in all the base moves {most.distance_m:.2f} m and {most.moving_s:.0f} s at most, "
        "whatever is measured (F47, F48)"
    )


def workspace_line(rig: RigConfig) -> str:
    """Return where the base may be, in words."""
    given = rig.workspace
    if given.x_m is not None and given.y_m is not None:
        (left, right), (low, high) = given.x_m, given.y_m
        return f"workspace: x {left:g} to {right:g} m, y {low:g} to {high:g} m, as the rig says"
    if given.polygon_m is not None:
        return f"workspace: the rig's polygon of {len(given.polygon_m)} corners"
    return (
        f"workspace: none in the rig; the base may go {SPARE_AROUND_M:g} m beyond its path on every side, "
        "from where it starts"
    )


def stopping_line(found: Stopping) -> str:
    """Return the distances to rest, in words."""
    return (
        f"stopping distance at {found.speed_m_per_s:g} m/s: {found.stop_m * 100:.1f} cm after a stop, "
        f"{found.alone_m * 100:.1f} cm if this computer dies, {found.slowest_m * 100:.1f} cm after the slowest fault "
        f"({found.slowest_row}: {FAULTS[found.slowest_row].text})"
    )
