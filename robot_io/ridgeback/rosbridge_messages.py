"""ROS messages as the bridge writes them in JSON, decoded to what this program uses of them; pure.

Every number may be null, the bridge's word for NaN and infinity. A pose that cannot be used keeps its flaw in
words instead of raising; what is not the expected message at all raises `ValueError`. Time stamps of ROS 1
(`secs`, `nsecs`) and ROS 2 (`sec`, `nanosec`) are both read.
Source: message definitions of geometry_msgs, nav_msgs, sensor_msgs and ridgeback_msgs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, TypeVar

import msgspec

from robot_io.clock import NS_PER_S
from robot_io.geometry import yaw_from_quaternion
from robot_io.messages import BaseStatus, BodyTwist, Pose2D
from robot_io.odometry_pose import NO_COVARIANCE, OdometryPose

T = TypeVar("T")
_NAN = float("nan")
Number = float | None


class PoseReading(msgspec.Struct, frozen=True, gc=False):
    """A pose as a message gives it: m, rad, frames by name, the sender's clock; `flaw` is "" when usable."""

    pose: Pose2D
    flaw: str
    frame: str
    child_frame: str
    stamp_ns: int
    """ns since 1970 by the sender's clock; 0 where it gives none."""

    @property
    def stamp_s(self) -> float:
        """Return the stamp in s."""
        whole, part = divmod(self.stamp_ns, NS_PER_S)
        return whole + part * 1e-9


class OdometryReading(msgspec.Struct, frozen=True, gc=False):
    """Pose in the odometry frame and velocity in the BODY frame."""

    reading: PoseReading
    twist: BodyTwist
    pose: OdometryPose | None
    """Pose and covariances as they came; None where a number of the pose is null."""


def is_stamped(type_name: str) -> bool:
    """Return whether a command type wraps the twist in a header (geometry_msgs/TwistStamped, either ROS)."""
    return type_name.rpartition("/")[2] == "TwistStamped"


_Int32 = Annotated[int, msgspec.Meta(ge=-(2**31), lt=2**32)]
"""Signed or not: whatever either ROS keeps in 32 bits. A longer number could not become a float."""


class _Stamp(msgspec.Struct, gc=False):
    """`secs`/`nsecs` come from ROS 1, `sec`/`nanosec` from ROS 2."""

    secs: _Int32 = 0
    nsecs: _Int32 = 0
    sec: _Int32 = 0
    nanosec: _Int32 = 0


class _Header(msgspec.Struct, gc=False):
    stamp: _Stamp
    frame_id: str = ""


class _Vector(msgspec.Struct, gc=False):
    x: Number
    y: Number
    z: Number


class _Quaternion(msgspec.Struct, gc=False):
    x: Number
    y: Number
    z: Number
    w: Number


class _Transform(msgspec.Struct, gc=False):
    translation: _Vector
    rotation: _Quaternion


class _TransformStamped(msgspec.Struct, gc=False):
    header: _Header
    transform: _Transform
    child_frame_id: str = ""


class _Pose(msgspec.Struct, gc=False):
    position: _Vector
    orientation: _Quaternion


class _Twist(msgspec.Struct, gc=False):
    linear: _Vector
    angular: _Vector


class _TwistStamped(msgspec.Struct, gc=False):
    twist: _Twist


class _PoseWithCovariance(msgspec.Struct, gc=False):
    pose: _Pose
    covariance: list[Number] = []


class _TwistWithCovariance(msgspec.Struct, gc=False):
    twist: _Twist
    covariance: list[Number] = []


class _Odometry(msgspec.Struct, gc=False):
    header: _Header
    pose: _PoseWithCovariance
    twist: _TwistWithCovariance
    child_frame_id: str = ""


class _JointState(msgspec.Struct, gc=False):
    header: _Header
    name: list[str]
    position: list[Number]


class _Status(msgspec.Struct, gc=False):
    stop_engaged: bool
    drivers_active: bool
    measured_battery: Number


def decoder_of(kind: type[T]) -> Callable[[bytes], T]:
    """Return a function from JSON text to `kind`; it raises ValueError for anything else."""
    decode = msgspec.json.Decoder(kind).decode  # its own errors are subclasses of ValueError

    def decode_or_refuse(text: bytes) -> T:
        try:
            return decode(text)
        except RecursionError as error:
            raise ValueError("JSON nested too deeply") from error

    return decode_or_refuse


_decode_transform = decoder_of(_TransformStamped)
_decode_odometry = decoder_of(_Odometry)
_decode_joints = decoder_of(_JointState)
_decode_status = decoder_of(_Status)
_decode_twist = decoder_of(_Twist)
_decode_twist_stamped = decoder_of(_TwistStamped)


def decode_transform(msg: bytes) -> PoseReading:
    """Decode a geometry_msgs/TransformStamped."""
    m = _decode_transform(msg)
    return _reading(m.header, m.child_frame_id, m.transform.translation, m.transform.rotation)


def decode_odometry(msg: bytes) -> OdometryReading:
    """Decode a nav_msgs/Odometry."""
    m = _decode_odometry(msg)
    pose = m.pose.pose
    reading = _reading(m.header, m.child_frame_id, pose.position, pose.orientation)
    return OdometryReading(reading, _body(m.twist.twist), _as_sent(m))


def decode_joint_states(msg: bytes) -> PoseReading:
    """Decode a sensor_msgs/JointState whose joints x, y and yaw are the base's pose; it names no child frame."""
    m = _decode_joints(msg)
    by_name = dict(zip(m.name, m.position, strict=False))
    x, y, yaw = (_number(by_name.get(name)) for name in ("x", "y", "yaw"))
    flaw = "" if all(map(math.isfinite, (x, y, yaw))) else "x, y or yaw is missing or null"
    return PoseReading(Pose2D(x, y, math.remainder(yaw, math.tau)), flaw, m.header.frame_id, "", _stamp_ns(m.header))


def decode_status(msg: bytes) -> BaseStatus:
    """Decode a ridgeback_msgs/Status."""
    m = _decode_status(msg)
    return BaseStatus(m.stop_engaged, m.drivers_active, _number(m.measured_battery))


def decode_twist(msg: bytes, type_name: str) -> BodyTwist:
    """Decode a geometry_msgs/Twist or TwistStamped, whichever `type_name` says."""
    return _body(_decode_twist_stamped(msg).twist if is_stamped(type_name) else _decode_twist(msg))


def _number(value: Number) -> float:
    return _NAN if value is None else value


def _stamp_ns(header: _Header) -> int:
    stamp = header.stamp
    return (stamp.secs or stamp.sec) * NS_PER_S + (stamp.nsecs or stamp.nanosec)


def _as_sent(m: _Odometry) -> OdometryPose | None:
    at, turned = m.pose.pose.position, m.pose.pose.orientation
    position = (_number(at.x), _number(at.y), _number(at.z))
    orientation = (_number(turned.x), _number(turned.y), _number(turned.z), _number(turned.w))
    if not all(map(math.isfinite, (*position, *orientation))):
        return None
    covariances = _covariance(m.pose.covariance), _covariance(m.twist.covariance)
    return OdometryPose(m.header.frame_id, m.child_frame_id, position, orientation, *covariances)


def _covariance(values: list[Number]) -> tuple[float, ...]:
    """Return a covariance; one with a null in it, or of another size, says nothing."""
    numbers = tuple(_number(value) for value in values)
    return numbers if len(numbers) == len(NO_COVARIANCE) and all(map(math.isfinite, numbers)) else NO_COVARIANCE


def _body(twist: _Twist) -> BodyTwist:
    return BodyTwist(_number(twist.linear.x), _number(twist.linear.y), _number(twist.angular.z))


def _reading(header: _Header, child: str, position: _Vector, q: _Quaternion) -> PoseReading:
    x, y = _number(position.x), _number(position.y)
    parts = (_number(q.x), _number(q.y), _number(q.z), _number(q.w))
    yaw = yaw_from_quaternion(*parts)
    flaw = ""
    if not (math.isfinite(x) and math.isfinite(y) and all(map(math.isfinite, parts))):
        flaw = "a number of the pose is null"
    elif yaw is None:
        flaw = "the rotation is not an upright unit quaternion"
    pose = Pose2D(x, y, _NAN if yaw is None else yaw)
    return PoseReading(pose, flaw, header.frame_id, child, _stamp_ns(header))
