"""The message types that flow between drivers, control and safety.

Frames: WORLD is the fixed frame of the base localisation (x, y on the floor, z up, yaw about z). BODY is the
base's own frame (x forward, y left). SENSOR is the FT 300's frame (+z out of the tool side). A twist or a
wrench in one frame is a different type from the same in another, so that a mix-up is a type error.
All are frozen, built of floats, ints and tuples, in SI units.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Generic, TypeVar

import msgspec

T = TypeVar("T")


class Stamped(msgspec.Struct, Generic[T], frozen=True, gc=False):
    """A value with its sequence number, its arrival (CLOCK_MONOTONIC ns) and the device's own time (s, NaN if none)."""

    value: T
    seq: int
    received_ns: int
    device_time_s: float = float("nan")


class SensorWrench(msgspec.Struct, frozen=True, gc=False):
    """What the FT 300 reports: N and N*m in the SENSOR frame, bias and tool weight still in it."""

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


Joints = tuple[float, float, float, float, float, float]


class JointState(msgspec.Struct, frozen=True, gc=False):
    """State of the arm: rad, rad/s, and the controller's own mode numbers (UR RTDE guide, CB3)."""

    position: Joints
    velocity: Joints
    robot_mode: int
    safety_mode: int
    safety_bits: int
    robot_status_bits: int
    runtime_state: int
    speed_scaling: float
    controller_time_s: float


class BaseStatus(msgspec.Struct, frozen=True, gc=False):
    """What the Ridgeback's microcontroller reports: stop pressed, motors driven, battery in volt."""

    stop_engaged: bool
    drivers_active: bool
    battery_v: float


class LinkState(IntEnum):
    """State of a device's link as its driver sees it; drivers stamp, safety judges."""

    CLOSED = 0
    OPENING = 1
    UP = 2
    LOST = 3
    """The link is gone (error, EOF, reset). A driver never resumes by itself."""


class DeviceInfo(msgspec.Struct, frozen=True, gc=False):
    """Identity a device gave when it was opened: kind, where, model, firmware or version, serial."""

    device: str
    where: str
    model: str = ""
    version: str = ""
    serial: str = ""


class DeviceHealth(msgspec.Struct, frozen=True, gc=False):
    """Link state, its cause in words ("" when up), and counters by name (monotonic ints) and rate in Hz."""

    state: LinkState
    cause: str
    counters: dict[str, int]
    rate_hz: float
