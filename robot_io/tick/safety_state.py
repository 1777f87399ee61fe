"""What safety and the envelope remember from tick to tick."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec

from robot_io.messages import BodyTwist, Vector3
from robot_io.tick.field_types import U32, Counts6, Vector4


class Mode(IntEnum):
    """The supervisor's mode; a higher number is a stronger reaction."""

    SILENT = 0
    READY = 1
    PUSHING = 2
    SLOW = 3
    HOLD = 4
    STOP = 5
    DEAD = 6


class ForceState(msgspec.Struct, frozen=True, gc=False):
    """What the checks of the force remember."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ForceState"
    crc_fail: int = 0
    """The sensor's count of damaged packets at the last tick."""
    damaged_ns: tuple[int, ...] = ()
    damaged: tuple[int, ...] = ()
    """When packets were damaged lately, and how many each time."""
    counted_ns: tuple[int, ...] = ()
    counted: tuple[int, ...] = ()
    """The sensor's count of good packets, each tenth of a second of the last one."""
    axis_runs: Counts6 = (0,) * 6
    """Equal readings in a row of each axis."""
    before_last: Vector3 = (0.0, 0.0, 0.0)
    """The force of the reading before the last one, N, SENSOR frame, bias in it."""
    wrong_run: int = 0
    """Readings in a row whose force cannot be that of an object being pushed."""
    stuck_since_ns: int = 0
    """Since when it has been watched whether a large force moves anything; 0: it is not."""
    sent_x: float = 0.0
    sent_y: float = 0.0
    """Displacement of the base that was commanded since, m, WORLD frame."""
    from_x: float = 0.0
    from_y: float = 0.0
    """Where the base was then, m, WORLD frame."""
    high_ns: int = 0
    """For how long in all the force of this push has been higher than it should be."""
    histogram: tuple[U32, ...] = ()
    """How often the force of this push was seen in each newton, from 0 on; all larger ones come last."""


class MotionMark(msgspec.Struct, frozen=True, gc=False):
    """One moment to which a later one is compared: the pose, and the ways that odometry and command add up to.

    m, rad, WORLD frame; both ways are turned by the measured heading.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/MotionMark"
    at_ns: int = 0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    way_x: float = 0.0
    way_y: float = 0.0
    way_yaw: float = 0.0
    sent_x: float = 0.0
    sent_y: float = 0.0


class MotionState(msgspec.Struct, frozen=True, gc=False):
    """How far the base has come: by pose, by odometry and by what was sent to it."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/MotionState"
    group: Annotated[int, "uint8"] = 0
    """0 before the first motion, 1 approach, 2 push, 3 retreat; what follows counts within it."""
    at_ns: int = 0
    sent_m: float = 0.0
    measured_m: float = 0.0
    moving_ns: int = 0
    """Time in motion."""
    vx: float = 0.0
    vy: float = 0.0
    """Smoothed measured velocity, m/s, BODY frame."""
    measured_ns: int = 0
    resumes: int = 0
    """How many of the operator's resumes have been allowed for."""
    from_x: float = 0.0
    from_y: float = 0.0
    """Where the base stood as the group began, m, WORLD frame."""
    lead_x: float = 0.0
    lead_y: float = 0.0
    """Where the directions that control asked for lead from there, m, WORLD frame."""
    aside_run: int = 0
    """Consecutive ticks in which the base went elsewhere."""
    agreed_ns: int = 0
    """The time up to which the ways below are added up; 0 before the first motion."""
    pose_ns: int = 0
    way_x: float = 0.0
    way_y: float = 0.0
    way_yaw: float = 0.0
    sent_x: float = 0.0
    sent_y: float = 0.0
    still_x: float = 0.0
    still_y: float = 0.0
    """Where the pose last was more than 5 mm from the place before, m, WORLD frame ..."""
    still_way_x: float = 0.0
    still_way_y: float = 0.0
    """... and the way by odometry then."""
    pose_run: int = 0
    """Consecutive poses that disagree with odometry."""
    command_run: int = 0
    """Consecutive ticks in which odometry disagrees with the command."""
    marks: tuple[MotionMark, ...] = ()
    """Oldest first."""


class WorkspaceState(msgspec.Struct, frozen=True, gc=False):
    """Where the base may be when the rig gives no workspace: a box about the path, as it lies from the start."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/WorkspaceState"
    known: bool = False
    """Whether the run has begun to move; until then the box is not fixed."""
    corners_x: Vector4 = (0.0, 0.0, 0.0, 0.0)
    corners_y: Vector4 = (0.0, 0.0, 0.0, 0.0)
    """Corners of the box in order, m, WORLD frame."""


class ClockState(msgspec.Struct, frozen=True, gc=False):
    """What `HostInput.asleep_ns` was in the last tick, once one is known."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ClockState"
    asleep_ns: int = 0
    known: bool = False


class SafetyState(msgspec.Struct, frozen=True, gc=False):
    """What safety remembers from tick to tick."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/SafetyState"
    mode: Annotated[int, "uint8", Mode] = 0
    first_ns: int = 0
    """When the first tick ran."""
    latched: tuple[str, ...] = ()
    """Faults that only the operator or a restart clears."""
    clean_since_ns: int = 0
    """Since when no clearing fault has asked for SLOW or HOLD."""
    stop_since_ns: int = 0
    zero_since_ns: int = 0
    """Since when the command has been zero (0: it is not)."""
    grace_ticks: int = 0
    """Ticks left in which a pause of the host is not taken for a dead device."""
    last_ft_ns: int = 0
    frozen_run: int = 0
    """Equal readings in a row of all axes at once."""
    last_ft_force: Vector3 = (0.0, 0.0, 0.0)
    last_ft_torque: Vector3 = (0.0, 0.0, 0.0)
    arm_packets: int = 0
    """How many packets of the arm have been judged."""
    arm_velocity_run: int = 0
    overspeed_run: int = 0
    overspeed_seq: int = 0
    ignore_since_ns: int = 0
    moving_since_ns: int = 0
    pose_seq: int = 0
    pose_x: float = 0.0
    pose_y: float = 0.0
    pose_yaw: float = 0.0
    pose_ns: int = 0
    pose_jumps: int = 0
    recorder_gone_ns: int = 0
    late_run: int = 0
    first_fault: str = ""
    """The row that first asked for HOLD or more, and still explains the mode; "" while there is none."""
    first_value: float = float("nan")
    """What was measured then, in the row's unit."""
    first_fault_ns: int = 0
    force: ForceState = ForceState()
    workspace: WorkspaceState = WorkspaceState()
    clock: ClockState = ClockState()
    motion: MotionState = MotionState()


class EnvelopeState(msgspec.Struct, frozen=True, gc=False):
    """The last command, for the rate limit: m/s, m/s, rad/s in the BODY frame."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/EnvelopeState"
    last: BodyTwist = BodyTwist()
    clamps: int = 0
    """How often a velocity has been clamped."""
    clamped: bool = False
    """Whether this tick's velocity was clamped."""
