"""The message types that flow between drivers, control and safety.

Frames: WORLD is the fixed frame of the base localisation (x, y on the floor, z up, yaw about z). BODY is the
base's own frame (x forward, y left). SENSOR is the frame of the force-torque sensor (FT 300: +z out of the tool
side). A twist or a wrench in one frame is a different type from the same in another, so that a mix-up is a type error.
All are frozen, built of floats, ints and tuples, in SI units.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar, Generic, TypeVar

import msgspec

from robot_io.named_values import ArmError as ArmError
from robot_io.named_values import Latch
from robot_io.odometry_pose import OdometryPose as OdometryPose

T = TypeVar("T")
Vector3 = tuple[float, float, float]
_NAN = float("nan")
Vector6 = tuple[float, float, float, float, float, float]
_STAMPS_S = (946_684_800, 2**31)
"""From 2000 to what ROS can express, s since 1970: an earlier stamp is of a clock that was never set."""


class Stamped(msgspec.Struct, Generic[T], frozen=True, gc=False):
    """A sample with the time at which it came."""

    value: T
    seq: int
    """Counts samples of this kind; a number that is missing is a sample that was dropped."""
    received_ns: int
    """When it arrived, CLOCK_MONOTONIC."""
    device_time_s: float = float("nan")
    """The device's own time (s), NaN where it gives none."""
    stamp_ns: int = 0
    """The time that its sender wrote into the message, ns since 1970 by the sender's clock; 0 where it has none."""

    @property
    def epoch_ns(self) -> int:
        """Return `stamp_ns` where it is a time between 2000 and 2038, else 0."""
        first_s, last_s = _STAMPS_S
        return self.stamp_ns if first_s * 10**9 <= self.stamp_ns < last_s * 10**9 else 0


class SensorWrench(msgspec.Struct, frozen=True, gc=False):
    """What a force-torque sensor reports: N and N*m in the SENSOR frame, bias and tool weight still in it."""

    fx: float
    fy: float
    fz: float
    mx: float
    my: float
    mz: float


class WorldTwist(msgspec.Struct, frozen=True, gc=False):
    """Planar velocity in the WORLD frame: m/s, m/s, rad/s (counter-clockwise positive)."""

    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0


class BodyTwist(msgspec.Struct, frozen=True, gc=False):
    """Planar velocity in the BODY frame of the base: m/s forward, m/s left, rad/s counter-clockwise."""

    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0


class Pose2D(msgspec.Struct, frozen=True, gc=False):
    """Planar pose in the WORLD frame: m, m, rad in (-pi, pi]."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


Joints = Vector6
"""Six joints of an arm: base, shoulder, elbow, wrist 1, 2, 3 (rad or rad/s)."""


class ArmState(IntEnum):
    """What an arm's driver makes of its controller's own modes and bits."""

    UNKNOWN = 0
    HOLDING = 1
    """Powered, brakes released, standing where it is."""
    MOVING = 2
    """It moves, or may be moved by hand."""
    PROTECTIVE_STOP = 3
    """Stopped by its own safety functions, or by a safeguard."""
    EMERGENCY_STOP = 4
    OFF = 5
    """Powered off, booting, or with brakes on: as a whole or at one joint."""
    FOREIGN_PROGRAM = 6
    """A program that is not ours is running, or paused, and may move it."""


class JointState(msgspec.Struct, frozen=True, gc=False):
    """State of the arm: rad, rad/s, an `ArmState`, and the time of its controller (s)."""

    position: Joints
    """Base, shoulder, elbow, wrist 1, 2, 3 (rad)."""
    velocity: Joints
    """The same joints (rad/s)."""
    state: Annotated[int, "uint8", ArmState]
    """An `ArmState`."""
    device_state: int
    """The controller's own modes, packed by its driver: for the log and its maker's manual, judged by nobody."""
    controller_time_s: float


class BaseStatus(msgspec.Struct, frozen=True, gc=False):
    """What the Ridgeback's microcontroller reports."""

    stop_engaged: bool
    """A stop is pressed."""
    drivers_active: bool
    """The motors are driven."""
    battery_v: float
    """Volt."""


class LinkState(IntEnum):
    """State of a device's link as its driver sees it; drivers stamp, safety judges."""

    CLOSED = 0
    OPENING = 1
    UP = 2
    LOST = 3
    """The link is gone (error, EOF, reset). A driver never resumes by itself."""


class ClockOffset(msgspec.Struct, frozen=True, gc=False):
    """How far a device's wall clock is ahead of this machine's, and how well that is known: s."""

    ahead_s: float
    within_s: float


class DeviceInfo(msgspec.Struct, frozen=True, gc=False):
    """Identity that a device gave when it was opened."""

    device: str
    where: str
    """Port, host or address."""
    model: str = ""
    version: str = ""
    """Of its firmware or software."""
    serial: str = ""
    remarks: tuple[str, ...] = ()
    """What was noticed while it was opened and the operator should know, in words."""
    clock: ClockOffset | None = None
    """Of the clock that stamps its messages; None where it has none or does not tell."""


class DeviceHealth(msgspec.Struct, frozen=True, gc=False):
    """How a device's link is, as its driver sees it."""

    state: LinkState
    cause: str
    """Why, in words; "" when it is up."""
    counters: dict[str, int]
    """What the driver counts, by name; they only grow while it is open."""
    rate_hz: float
    """Samples a second of late, 0 where there are none."""


class BasePose(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Pose of the base in the WORLD frame. `flaw` says why it is not usable ("" when it is)."""

    pose: Pose2D
    flaw: str = ""

    @property
    def valid(self) -> bool:
        """Return whether the pose may be used."""
        return not self.flaw


class BaseOdometry(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Measured velocity in the BODY frame; NaN where the message held null."""

    twist: BodyTwist
    pose: OdometryPose | None = None
    """What else the message said, for the log; None where there is none, or a number of it was null."""


class BaseReport(msgspec.Struct, frozen=True, gc=False, tag=True):
    """What the base's microcontroller says of stops, motors and battery."""

    status: BaseStatus


class SliderPose(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Pose of the pushed object in the WORLD frame, from motion capture: for log and workspace, never for control."""

    pose: Pose2D
    flaw: str = ""


class CommandEcho(msgspec.Struct, frozen=True, gc=False, tag=True):
    """A velocity heard on the base's own command topic, ours or another's: proof that commands get there."""

    twist: BodyTwist
    ours: bool = True
    """Whether this driver has sent it."""


BaseFeed = BasePose | BaseOdometry | BaseReport | SliderPose | CommandEcho
"""What a base gives: every sample is one of these."""


ZERO_JOINTS: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ArmRecord(msgspec.Struct, frozen=True, gc=False):
    """Newest state of the arm: joints (rad, rad/s), times in CLOCK_MONOTONIC ns, 0 where there is none yet."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ArmRecord"
    joints: JointState = JointState(ZERO_JOINTS, ZERO_JOINTS, ArmState.UNKNOWN, 0, 0.0)
    packets: int = 0
    """How many packets of the controller were seen; the sequence number of `joints`."""
    published_ns: int = 0
    """When this record was written."""
    changed_ns: int = 0
    """When the controller's time stamp was last seen to change."""
    link: Annotated[int, "uint8", LinkState] = 0
    """A `LinkState`."""
    error: Annotated[int, "uint8", ArmError] = 0
    """An `ArmError`."""
    servo: bool = False
    """The arm is held actively (`hold = "servo"`) and so far without a fault."""
    child_pid: int = 0


NO_ARM = ArmRecord()
"""What a reader holds before the first record."""


class BaseRecord(msgspec.Struct, frozen=True, gc=False):
    """Newest state of the base: m, rad, m/s, rad/s; times in CLOCK_MONOTONIC ns, 0 where there is none yet."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/BaseRecord"
    pose: Pose2D = Pose2D(_NAN, _NAN, _NAN)
    """Pose of the base (not of its markers) in the WORLD frame."""
    pose_valid: bool = False
    """False: the newest pose message was no usable pose (null, no unit quaternion, another frame)."""
    pose_received_ns: int = 0
    pose_seq: int = 0
    """Counts pose messages, valid or not."""
    odometry: BodyTwist = BodyTwist(_NAN, _NAN, _NAN)
    """Measured velocity in the BODY frame; NaN where the message held null."""
    odometry_received_ns: int = 0
    odometry_seq: int = 0
    status: BaseStatus = BaseStatus(False, False, _NAN)
    status_received_ns: int = 0
    newest_inbound_ns: int = 0
    """When the newest message of any topic arrived."""
    newest_pong_ns: int = 0
    """When the bridge last answered a ping: proves its I/O thread only."""
    accepted_seq: int = 0
    """Sequence number of the last frame of control that the gate accepted."""
    verdict: Annotated[int, "uint8", Latch] = 0
    """Why the gate did not accept the newest frame that it read (a `Latch` number; 0: it did).

    After a latch this is its cause, whatever the frame. A latch without a frame shows in `latch_cause` alone."""
    sent: BodyTwist = BodyTwist()
    """What really went out last."""
    sent_ns: int = 0
    latched: bool = False
    """The gate sends nothing but zero until it is restarted."""
    latch_cause: Annotated[int, "uint8", Latch] = 0
    """The `Latch` that came first, 0: none."""
    published_ns: int = 0
    """When this record was written."""
    travel_m: float = 0.0
    """How far the base has travelled since the run's first motion: as sent or as measured, whichever is more."""
    moving_s: float = 0.0
    """How long it has moved since then."""
    object_pose: Pose2D = Pose2D(_NAN, _NAN, _NAN)
    """The newest usable pose of the pushed object, where motion capture sees it: for the workspace only."""
    object_received_ns: int = 0
    lag_ns: int = 0
    """How much older odometry has become on its way than it was in the run's first second, by its own stamps."""
    pose_stamp_ns: int = 0
    odometry_stamp_ns: int = 0
    """When the sender says that pose and odometry are of, ns since 1970 by its own clock; 0: it does not say."""


NO_BASE = BaseRecord()
"""What a reader holds before the first record."""
