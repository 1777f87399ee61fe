"""The floor that a push needs and may use: polygons about the path, as it lies from the start."""

from __future__ import annotations

import math

import msgspec

from robot_io.geometry import StraightPath, point_outside
from robot_io.messages import Pose2D
from robot_io.polygon import Point, Polygon, room
from robot_io.rig.config import RigConfig
from safety.stopping import alone_m

SPARE_AHEAD_M = 0.5
"""Contact may come this much later than expected before the object counts as missing (F53)."""
SPARE_AROUND_M = 1.0
"""Without a workspace in the rig, the base may go this far beyond the floor that the path needs, on every side."""
SLOW_TIMES = 2.0
"""It slows down this many stopping distances (at full speed) before the edge."""


class WorkspaceSettings(msgspec.Struct, frozen=True, gc=False):
    """Workspace, path and sizes of a rig, in m and rad, WORLD frame."""

    given: Polygon
    """Empty where the rig gives none."""
    path: StraightPath
    contact_in_base: Point
    half_length: float
    half_width: float
    """Half of the base's outline."""
    object_half: float
    """Half of the diagonal of the longest object: it may stand turned."""
    object_seen: bool
    """Whether the object's pose is known, in the frame of the base's."""
    approach_m: float
    distance_m: float
    speed: float

    @classmethod
    def of(cls, rig: RigConfig) -> WorkspaceSettings:
        """Resolve the settings of a rig."""
        length, width = rig.base.outline_m
        return cls(
            rig.workspace.corners,
            StraightPath.of(rig.path.origin_m, rig.path.direction_deg),
            rig.frames.contact_in_base_m[:2],
            length / 2.0,
            width / 2.0,
            math.sqrt(0.5) * rig.sliders.longest_m,
            bool(rig.base.topics.slider_pose) and rig.base.pose_source == "mocap",
            rig.path.expected_contact_m,
            rig.control.distance_m,
            max(rig.control.push_speed_m_per_s, rig.control.approach_speed_m_per_s),
        )

    @property
    def slow_m(self) -> float:
        """Return how far before the edge it slows down."""
        return SLOW_TIMES * alone_m(self.speed)


def start_box(settings: WorkspaceSettings, start: Pose2D) -> Polygon:
    """Return where the base may go without a workspace in the rig, from its pose at the start."""
    return _base_way(settings, start, SPARE_AHEAD_M, SPARE_AROUND_M)


def room_for_push(settings: WorkspaceSettings, start: Pose2D, slider: Pose2D | None) -> float:
    """Return how much wider the given workspace is (m) than what this push needs from its start; negative: too small.

    start: pose of the base. slider: pose of the object, None where it is not known. Needed is, for the base's outline,
    the path from start to end and the band behind it in which it would slow down; for the object the path.
    """
    least = room(settings.given, _base_way(settings, start, settings.slow_m, 0.0))
    if slider is None:
        return least
    half = settings.object_half
    return min(least, room(settings.given, _way(settings.path, (slider.x, slider.y), settings.distance_m, half, half)))


def _base_way(settings: WorkspaceSettings, start: Pose2D, ahead_m: float, around_m: float) -> Polygon:
    """Return the rectangle that the base's outline covers from its start over the path, and so much more."""
    turned = start.yaw - settings.path.heading
    cos, sin = abs(math.cos(turned)), abs(math.sin(turned))
    half_along = settings.half_length * cos + settings.half_width * sin + around_m
    half_across = settings.half_length * sin + settings.half_width * cos + around_m
    contact = point_outside(start.x, start.y, start.yaw, *settings.contact_in_base)
    # The law brings the ball onto the path, and the base with it.
    aside = -settings.path.lateral(*contact)
    way_m = settings.approach_m + settings.distance_m + ahead_m
    return _way(settings.path, (start.x, start.y), way_m, half_along, half_across, aside)


def _way(
    path: StraightPath, start: Point, way_m: float, half_along: float, half_across: float, aside: float = 0.0
) -> Polygon:
    along, lateral = path.along(*start), path.lateral(*start)
    back, front = along - half_along, along + way_m + half_along
    right, left = lateral + min(aside, 0.0) - half_across, lateral + max(aside, 0.0) + half_across
    corners = ((back, right), (front, right), (front, left), (back, left))
    return tuple(path.point_in_world(*corner) for corner in corners)
