"""Everything one tick of the loop consumes and produces: the record that the log holds and replay folds again.

`TickInput` is all the outside world the tick sees. `TickState` is all it remembers. `TickOutput` is all it
says. A run is a fold of (state, input) -> (state, output), and `/control/tick` holds every part of it.
Times are CLOCK_MONOTONIC ns. Angles without a frame in their name are in the PATH frame.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.messages import ArmRecord, BaseRecord, BodyTwist, Vector3, Vector6, WorldTwist

Vector4 = tuple[float, float, float, float]
_ZERO6: Vector6 = (0.0,) * 6
U32 = Annotated[int, "uint32"]
Counts6 = tuple[U32, U32, U32, U32, U32, U32]


class Phase(IntEnum):
    """Where the push is in its sequence."""

    SETTLE = 0
    """Waiting until every device has sent data."""
    TARE = 1
    """At rest, out of contact: measuring bias and tool weight."""
    APPROACH = 2
    """Along the path until the force says contact."""
    PUSH = 3
    LOST = 4
    """The force is gone: circling back towards the path for a short while."""
    LOST_HOLD = 5
    """Given up circling: at rest, waiting for the operator for a moment."""
    REST = 6
    """The distance is reached: coming to rest."""
    RETREAT = 7
    """A few centimetres back, out of contact."""
    CHECK = 8
    """At rest, out of contact: does the sensor still read zero?"""
    DONE = 9
    FAILED = 10


REST_M_PER_S = 0.01
"""The base counts as being at rest below this measured speed ..."""
REST_NS = 300_000_000
"""... once it has stayed so for this long."""


class Mode(IntEnum):
    """The supervisor's mode; a higher number is a stronger reaction."""

    SILENT = 0
    READY = 1
    PUSHING = 2
    SLOW = 3
    HOLD = 4
    STOP = 5
    DEAD = 6


class Operator(IntEnum):
    """What the operator asked for since the last tick."""

    NONE = 0
    STOP = 1
    RESUME = 2


class TareSums(msgspec.Struct, frozen=True, gc=False):
    """Sums of samples and of their squares (N, N*m, SENSOR frame): all, the first quarter, the last quarter.

    All are of the difference to the first sample (`origin`), so that a large bias costs no digits.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/TareSums"
    count: int = 0
    origin: Vector6 = _ZERO6
    total: Vector6 = _ZERO6
    squares: Vector6 = _ZERO6
    first: Vector6 = _ZERO6
    first_squares: Vector6 = _ZERO6
    last: Vector6 = _ZERO6
    last_squares: Vector6 = _ZERO6
    second: Vector6 = _ZERO6
    third: Vector6 = _ZERO6
    """The second and the third distinct value of each axis; the first is `origin`."""
    distinct: Counts6 = (0,) * 6
    """How many distinct values each axis has shown: 4 means more than 3."""


class FtReading(msgspec.Struct, frozen=True, gc=False):
    """One packet of the force-torque sensor: N, N*m in the SENSOR frame, bias still in it."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/FtReading"
    received_ns: int
    seq: int
    force: Vector3
    torque: Vector3


class FtInput(msgspec.Struct, frozen=True, gc=False):
    """The sensor since the last tick: every packet, oldest first, and the state of its link."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/FtInput"
    readings: tuple[FtReading, ...]
    link: int
    packets_ok: int
    crc_fail: int
    junk_bytes: int


class HostInput(msgspec.Struct, frozen=True, gc=False):
    """The host: how late this tick woke, how many periods were skipped before it, and who is still alive."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/HostInput"
    late_ns: int
    skipped: int
    gate_alive: bool
    arm_alive: bool
    recorder_alive: bool
    loop_error: bool
    log_dropped: int
    launcher_silent_ns: int = 0
    """How long the launcher, which has the operator's keys, has given no sign of life."""
    recorder_silent_ns: int = 0
    """How long the recorder has taken nothing of what waited for it."""
    asleep_ns: int = 0
    """CLOCK_BOOTTIME minus CLOCK_MONOTONIC: grows only while this machine is suspended (0 at level sim)."""


class TickInput(msgspec.Struct, frozen=True, gc=False):
    """Everything the tick sees of the world."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickInput"
    tick: int
    now_ns: int
    operator: int
    host: HostInput
    ft: FtInput
    arm: ArmRecord
    base: BaseRecord


class ContactState(msgspec.Struct, frozen=True, gc=False):
    """What control remembers of the force, to tell contact from none: N, WORLD frame where nothing else is said."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ContactState"
    packets: int = 0
    """How many readings the median has seen, at most 2."""
    before_last: Vector3 = (0.0, 0.0, 0.0)
    last: Vector3 = (0.0, 0.0, 0.0)
    """The last two readings, SENSOR frame, bias still in them."""
    means: tuple[float, ...] = ()
    """x, y, z of the mean force in each tenth of a second: up to one second, while a contact is sought."""
    bucket_since_ns: int = 0
    bucket_total: Vector3 = (0.0, 0.0, 0.0)
    bucket_count: int = 0
    """The tenth of a second that is not yet full."""
    overdue: bool = False
    """Whether the search has already passed the place where the object was expected."""
    samples: tuple[float, ...] = ()
    """Size of the filtered force at each centimetre of the first half metre of contact, N."""
    lost_below_N: float = 0.0
    """Below this force the contact is lost; 0 until the object has been felt."""


class ControlState(msgspec.Struct, frozen=True, gc=False):
    """What control remembers from tick to tick."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ControlState"
    phase: int = 0
    phase_since_ns: int = 0
    tared: bool = False
    refusal: int = 0
    """Why the start was refused: 0 not, 1 unsettled, 2 nearly saturated, 3 dead axis, 4 implausible force."""
    bias_force: Vector3 = (0.0, 0.0, 0.0)
    bias_torque: Vector3 = (0.0, 0.0, 0.0)
    tare: TareSums = TareSums()
    last_reading_ns: int = 0
    force_world: Vector3 = (0.0, 0.0, 0.0)
    """Filtered force on the slider, N, WORLD frame."""
    force_valid: bool = False
    contact_run: int = 0
    """Consecutive readings above the contact threshold."""
    held_joints: Vector6 = (0.0,) * 6
    held_yaw: float = 0.0
    approach_from_m: float = 0.0
    """Where along the path the approach started."""
    contact_seen: bool = False
    contact_from_m: float = 0.0
    """Where along the path the first contact was."""
    progress_m: float = 0.0
    lateral_m: float = 0.0
    theta_f: float = 0.0
    theta_p: float = 0.0
    speed: float = 0.0
    ramp_since_ns: int = 0
    ramp_from_speed: float = 0.0
    anchor_x: float = 0.0
    anchor_y: float = 0.0
    """Contact point in the WORLD frame where LOST or RETREAT began, m."""
    rest_since_ns: int = 0
    backward_ticks: int = 0
    end_progress_m: float = 0.0
    end_lateral_m: float = 0.0
    residual_N: float = float("nan")
    """Force left after the run, out of contact; NaN when it was not checked."""
    lost_count: int = 0
    """How often the contact was lost after it was first found."""
    lost_m: float = 0.0
    """Distance travelled without the contact, as odometry measured it, since it was first found."""
    lost_ns: int = 0
    """Time in motion without the contact since it was first found."""
    early_contact: bool = False
    """Whether the first contact came more than 0.3 m, and half of the way, before it was expected."""
    force_before_contact_N: float = float("nan")
    """Size of the mean force in the half second before the first contact, where it should be 0; NaN before it."""
    felt_N: float = 0.0
    """Mean force along the motion over half a second, while a contact is sought."""
    contact: ContactState = ContactState()
    resumes: int = 0
    """How often the operator has resumed the push."""
    resume_refused: bool = False
    """Whether a further resume was refused in this rest."""


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
    group: int = 0
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
    mode: int = 0
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
    """Equal readings in a row of the axis that has repeated itself longest."""
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


class TickState(msgspec.Struct, frozen=True, gc=False):
    """Everything that is kept from tick to tick."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickState"
    control: ControlState = ControlState()
    safety: SafetyState = SafetyState()
    envelope: EnvelopeState = EnvelopeState()


class TickOutput(msgspec.Struct, frozen=True, gc=False):
    """What the tick says."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickOutput"
    mode: int
    faults: tuple[str, ...]
    wanted_world: WorldTwist
    wanted_body: BodyTwist
    """Before the envelope."""
    command_body: BodyTwist
    """After the envelope: what goes to the gate."""
    contact_x: float
    contact_y: float
    """Contact ball centre, m, WORLD frame."""
    finished: bool
    exit_code: int
    fault_values: tuple[float, ...] = ()
    """What was measured for each of `faults`, in the unit of its row; NaN where nothing is."""


class ControlTick(msgspec.Struct, frozen=True, gc=False):
    """The message on `/control/tick`. `crc32_before` chains it to the message before (0 at the start of a file)."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ControlTick"
    crc32_before: U32
    reserved: U32
    input: TickInput
    before: TickState
    after: TickState
    output: TickOutput


TICK_CDR = CdrType(ControlTick, "push_msgs/msg/ControlTick")
