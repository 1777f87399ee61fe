"""The standard ROS 2 messages this program writes, as Structs, and their CDR types.

Fields, order and widths are those of the interface packages of ROS 2 Humble to Jazzy (common_interfaces,
geometry2, rcl_interfaces); units are theirs: m, rad, s, N, N*m, quaternions x y z w.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.clock import NS_PER_S
from robot_io.messages import BodyTwist

Int32 = Annotated[int, "int32"]
UInt32 = Annotated[int, "uint32"]
UInt8 = Annotated[int, "uint8"]
Byte = Annotated[int, "byte"]
Covariance = Annotated[tuple[float, ...], 36]


class Time(msgspec.Struct, frozen=True, gc=False):
    """A point in time: s and ns since 1970."""

    __ros_name__: ClassVar[str] = "builtin_interfaces/msg/Time"
    sec: Int32
    nanosec: UInt32


class Header(msgspec.Struct, frozen=True, gc=False):
    """When, and in which frame."""

    __ros_name__: ClassVar[str] = "std_msgs/msg/Header"
    stamp: Time
    frame_id: str


class String(msgspec.Struct, frozen=True, gc=False):
    """A text."""

    __ros_name__: ClassVar[str] = "std_msgs/msg/String"
    data: str


class Vector3(msgspec.Struct, frozen=True, gc=False):
    """A free vector."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Vector3"
    x: float
    y: float
    z: float


class Quaternion(msgspec.Struct, frozen=True, gc=False):
    """A rotation."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Quaternion"
    x: float
    y: float
    z: float
    w: float


class Point(msgspec.Struct, frozen=True, gc=False):
    """A position, m."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Point"
    x: float
    y: float
    z: float


class Pose(msgspec.Struct, frozen=True, gc=False):
    """Position and orientation."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Pose"
    position: Point
    orientation: Quaternion


class PoseStamped(msgspec.Struct, frozen=True, gc=False):
    """A pose in a frame at a time."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/PoseStamped"
    header: Header
    pose: Pose


class PoseWithCovariance(msgspec.Struct, frozen=True, gc=False):
    """A pose and its 6x6 covariance, row by row (x y z, rotations about x y z)."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/PoseWithCovariance"
    pose: Pose
    covariance: Covariance


class Transform(msgspec.Struct, frozen=True, gc=False):
    """The pose of a child frame in its parent."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Transform"
    translation: Vector3
    rotation: Quaternion


class TransformStamped(msgspec.Struct, frozen=True, gc=False):
    """A transform; the parent frame is `header.frame_id`."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/TransformStamped"
    header: Header
    child_frame_id: str
    transform: Transform


class Twist(msgspec.Struct, frozen=True, gc=False):
    """Velocities: m/s and rad/s."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Twist"
    linear: Vector3
    angular: Vector3


class TwistStamped(msgspec.Struct, frozen=True, gc=False):
    """A twist in a frame at a time."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/TwistStamped"
    header: Header
    twist: Twist


class TwistWithCovariance(msgspec.Struct, frozen=True, gc=False):
    """A twist and its 6x6 covariance."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/TwistWithCovariance"
    twist: Twist
    covariance: Covariance


class Wrench(msgspec.Struct, frozen=True, gc=False):
    """Force in N and torque in N*m."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/Wrench"
    force: Vector3
    torque: Vector3


class WrenchStamped(msgspec.Struct, frozen=True, gc=False):
    """A wrench in a frame at a time."""

    __ros_name__: ClassVar[str] = "geometry_msgs/msg/WrenchStamped"
    header: Header
    wrench: Wrench


class JointState(msgspec.Struct, frozen=True, gc=False):
    """Joints by name: rad, rad/s, N*m; an empty sequence where nothing is known."""

    __ros_name__: ClassVar[str] = "sensor_msgs/msg/JointState"
    header: Header
    name: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


class Odometry(msgspec.Struct, frozen=True, gc=False):
    """Pose in `header.frame_id`, twist in `child_frame_id`."""

    __ros_name__: ClassVar[str] = "nav_msgs/msg/Odometry"
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


class Path(msgspec.Struct, frozen=True, gc=False):
    """A row of poses to follow."""

    __ros_name__: ClassVar[str] = "nav_msgs/msg/Path"
    header: Header
    poses: tuple[PoseStamped, ...]


class TFMessage(msgspec.Struct, frozen=True, gc=False):
    """Transforms between frames."""

    __ros_name__: ClassVar[str] = "tf2_msgs/msg/TFMessage"
    transforms: tuple[TransformStamped, ...]


class Log(msgspec.Struct, frozen=True, gc=False):
    """A line for people; level 10 debug, 20 info, 30 warning, 40 error, 50 fatal."""

    __ros_name__: ClassVar[str] = "rcl_interfaces/msg/Log"
    __ros_constants__: ClassVar[tuple[str, ...]] = (
        "byte DEBUG=10",
        "byte INFO=20",
        "byte WARN=30",
        "byte ERROR=40",
        "byte FATAL=50",
    )
    stamp: Time
    level: UInt8
    name: str
    msg: str
    file: str
    function: str
    line: UInt32


class KeyValue(msgspec.Struct, frozen=True, gc=False):
    """One value of a diagnostic status."""

    __ros_name__: ClassVar[str] = "diagnostic_msgs/msg/KeyValue"
    key: str
    value: str


class DiagnosticStatus(msgspec.Struct, frozen=True, gc=False):
    """State of one component; level 0 good, 1 warning, 2 error, 3 stale."""

    __ros_name__: ClassVar[str] = "diagnostic_msgs/msg/DiagnosticStatus"
    __ros_constants__: ClassVar[tuple[str, ...]] = ("byte OK=0", "byte WARN=1", "byte ERROR=2", "byte STALE=3")
    level: Byte
    name: str
    message: str
    hardware_id: str
    values: tuple[KeyValue, ...]


class DiagnosticArray(msgspec.Struct, frozen=True, gc=False):
    """States of several components at one time."""

    __ros_name__: ClassVar[str] = "diagnostic_msgs/msg/DiagnosticArray"
    header: Header
    status: tuple[DiagnosticStatus, ...]


STRING = CdrType(String, String.__ros_name__)
POSE_STAMPED = CdrType(PoseStamped, PoseStamped.__ros_name__)
TWIST_STAMPED = CdrType(TwistStamped, TwistStamped.__ros_name__)
WRENCH_STAMPED = CdrType(WrenchStamped, WrenchStamped.__ros_name__)
JOINT_STATE = CdrType(JointState, JointState.__ros_name__)
ODOMETRY = CdrType(Odometry, Odometry.__ros_name__)
PATH = CdrType(Path, Path.__ros_name__)
TF_MESSAGE = CdrType(TFMessage, TFMessage.__ros_name__)
LOG = CdrType(Log, Log.__ros_name__)
DIAGNOSTIC_ARRAY = CdrType(DiagnosticArray, DiagnosticArray.__ros_name__)

WORLD_FRAME, BASE_FRAME, SENSOR_FRAME = "world", "base_link", "ft_sensor"
"""The names that the frames WORLD, BODY and SENSOR have in a log."""
SENSOR_WORLD_FRAME = "ft_sensor_world"
"""At the origin of the sensor, with the axes of the WORLD frame: that of the wrench on the object."""


def ros_time(time_ns: int) -> Time:
    """Return a log time in ns as a ROS time."""
    sec, nanosec = divmod(time_ns, NS_PER_S)
    return Time(sec, nanosec)


def yaw_quaternion(yaw_rad: float) -> Quaternion:
    """Return the rotation by `yaw_rad` about z."""
    return Quaternion(0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))


def planar_pose(x_m: float, y_m: float, yaw_rad: float) -> Pose:
    """Return a pose in the plane z = 0."""
    return Pose(Point(x_m, y_m, 0.0), yaw_quaternion(yaw_rad))


def planar_twist(twist: BodyTwist) -> Twist:
    """Return a velocity in the plane."""
    return Twist(Vector3(twist.vx, twist.vy, 0.0), Vector3(0.0, 0.0, twist.omega))
