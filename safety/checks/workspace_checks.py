"""Checks that base and object stay where they may be (F55), and before the first motion that the push fits (R06).

All is judged where things would come to rest if this computer died now. The object is judged where its pose is known
in the frame of the base's, and the rig gives a workspace.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from msgspec.structs import replace

from robot_io.geometry import rotated
from robot_io.messages import Pose2D
from robot_io.polygon import Polygon, distance_inside, rectangle, room
from robot_io.tick import ControlState, Phase, SafetyState, TickInput, WorkspaceState
from safety.finding import Finding
from safety.settings import SafetySettings
from safety.stopping import ALONE_S, alone_m
from safety.workspace import WorkspaceSettings, room_for_push, start_box

STANDING_M_PER_S = 0.01
"""A slower measured speed has no direction."""
FAR_M = 1e6
"""Whatever would go further is outside anyway; beyond all numbers it would have no direction."""
CLEAR_M = 1e-6
"""With this much more room than the longest way ahead, rounding cannot find too little."""
OBJECT_KNOWN_NS = 500_000_000
"""An object that was not seen for longer is not judged: it is in nobody's view."""

_Shift = tuple[float, float, float]
"""m, m, rad, WORLD frame."""
_HERE: _Shift = (0.0, 0.0, 0.0)


class _Ahead(NamedTuple):
    """Shifts to where things would come to rest; `slow`: for the band of SLOW."""

    slow: list[_Shift]
    stop: list[_Shift]


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of the workspace.

    It is called after the checks of the base, which keep the newest good pose.
    """
    if not state.pose_seq or control.phase < Phase.APPROACH:
        return state, []
    workspace = settings.workspace
    pose = Pose2D(state.pose_x, state.pose_y, state.pose_yaw)
    slider = _object_pose(inp) if workspace.given and workspace.object_seen else None
    faults: list[str] = []
    if not state.workspace.known:
        state = replace(state, workspace=_begin(workspace, pose))
        if workspace.given and (left := room_for_push(workspace, pose, slider)) < 0.0:
            faults.append(Finding("R06", left))
    edge = workspace.given or tuple(zip(state.workspace.corners_x, state.workspace.corners_y, strict=True))
    age_s = (inp.now_ns - state.pose_ns) * 1e-9
    here = distance_inside(edge, pose.x, pose.y) - math.hypot(workspace.half_length, workspace.half_width)
    if slider is None and here > CLEAR_M + max(workspace.slow_m, _furthest_m(inp, age_s)):
        return state, faults  # in the middle of the floor, as nearly always
    ahead = _ahead(workspace, inp, pose.yaw, age_s)
    left_slow, left_stop = (
        min(_room_of_base(workspace, edge, pose, shifts, here), _room_of_object(workspace, slider, shifts))
        for shifts in (ahead.slow, ahead.stop)
    )
    if left_stop < 0.0:
        faults.append(Finding("F55-stop", left_stop))
    elif left_slow < 0.0:
        faults.append(Finding("F55-slow", left_slow))
    return state, faults


def _object_pose(inp: TickInput) -> Pose2D | None:
    """Return where the object is, None where that is not known or too old."""
    base, pose = inp.base, inp.base.object_pose
    fresh = base.object_received_ns > 0 and inp.now_ns - base.object_received_ns <= OBJECT_KNOWN_NS
    return pose if fresh and math.isfinite(pose.x) and math.isfinite(pose.y) else None


def _begin(workspace: WorkspaceSettings, start: Pose2D) -> WorkspaceState:
    a, b, c, d = start_box(workspace, start)
    return WorkspaceState(True, (a[0], b[0], c[0], d[0]), (a[1], b[1], c[1], d[1]))


def _furthest_m(inp: TickInput, age_s: float) -> float:
    """Return how far at most anything would go on by the velocities of `_ahead`; infinite where one is no number."""
    sent, measured = inp.base.sent, inp.base.odometry
    speed = max(math.hypot(sent.vx, sent.vy), math.hypot(measured.vx, measured.vy))
    known = math.isfinite(sent.vx + sent.vy + measured.vx + measured.vy)
    return alone_m(speed) + abs(age_s) * speed if known else math.inf


def _ahead(workspace: WorkspaceSettings, inp: TickInput, yaw: float, age_s: float) -> _Ahead:
    """Return where things would come to rest, by the velocity that was sent and by the measured one."""
    slow, stop = [_HERE], [_HERE]
    for twist in (inp.base.sent, inp.base.odometry):
        speed = math.hypot(twist.vx, twist.vy)
        if not (speed > 0.0 and math.isfinite(speed) and math.isfinite(twist.omega)):
            continue
        dx, dy = rotated(twist.vx / speed, twist.vy / speed, yaw)
        turn = twist.omega * ALONE_S
        stop_m = min(alone_m(speed) + age_s * speed, FAR_M)
        stop.append((dx * stop_m, dy * stop_m, turn))
        if speed > STANDING_M_PER_S:
            # By the rig's speed, not by the present one: the band does not end because SLOW has halved the speed.
            slow_m = max(workspace.slow_m, stop_m)
            slow.append((dx * slow_m, dy * slow_m, turn))
    return _Ahead(slow, stop)


def _room_of_base(
    workspace: WorkspaceSettings, edge: Polygon, pose: Pose2D, shifts: list[_Shift], here: float
) -> float:
    """Return the least room (m) of the base's outline there; `here`: the least it has at its pose, however turned."""
    length, width = workspace.half_length, workspace.half_width
    far = here - max([math.hypot(dx, dy) for dx, dy, _ in shifts])
    if far > 0.0:
        return far
    return min(
        room(edge, rectangle(Pose2D(pose.x + dx, pose.y + dy, pose.yaw + turn), (-length, length), (-width, width)))
        for dx, dy, turn in shifts
    )


def _room_of_object(workspace: WorkspaceSettings, slider: Pose2D | None, shifts: list[_Shift]) -> float:
    """Return the same for the object, which moves at most as the base does."""
    if slider is None:
        return math.inf
    half = workspace.object_half
    return min(distance_inside(workspace.given, slider.x + dx, slider.y + dy) - half for dx, dy, _ in shifts)
