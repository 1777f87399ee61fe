"""The settings that control takes from a rig file, resolved once."""

from __future__ import annotations

import msgspec

from control.laws.applied import AppliedLaw
from control.laws.law import Law
from control.laws.shipped import shipped_law
from control.tare import SMALLEST_COUNT, Flags6
from robot_io.geometry import StraightPath
from robot_io.messages import Vector6
from robot_io.rig.config import ControlConfig, RigConfig
from robot_io.rig.types import Matrix3

CONTACT_RATE_HZ = 100.0
"""`contact_samples` counts readings at this rate."""
CHECK_S = 1.0
"""The limit of the residual is newtons, far above the uncertainty of the mean of 1 s."""
SETTLE_S = 0.2


class Settings(msgspec.Struct, frozen=True, gc=False):
    """Gains, path and constants of the rig; `in_contact`: start in contact, without approach and with a saved tare."""

    control: ControlConfig
    law: AppliedLaw
    sensor_noise: Vector6
    """One standard deviation of each axis at rest: N, N*m."""
    sensor_range: Vector6
    """The largest reading of each axis: N, N*m."""
    sensor_resolution: Vector6
    """The smallest step of each axis: N, N*m."""
    path: StraightPath
    base_from_sensor: Matrix3
    contact_x: float
    contact_y: float
    """Contact ball centre in the BODY frame, m."""
    expected_contact_m: float
    ramp_s: float
    """Duration of the push's ramps, s: the rig's value, or longer where its acceleration limit requires it."""
    period_s: float
    """Period of the loop, s."""
    tare_readings: int
    """How many readings a tare needs, at the sensor's declared rate."""
    check_readings: int
    """How many of them are enough to see, after the push, whether the sensor still reads zero."""
    settle_readings: int
    """How many readings the sensor must have sent before the run starts."""
    contact_readings: int
    """How many consecutive readings above the threshold count as contact."""
    in_contact: bool
    scatters: Flags6 = (True,) * 6
    """Whether each axis of the sensor scatters at rest, so that one that does not is dead."""

    @classmethod
    def of(cls, rig: RigConfig, *, in_contact: bool = False, law: Law | None = None) -> Settings:
        """Resolve the settings of a rig. law: its law where it is not a shipped one; raises ConfigError without it."""
        contact_x, contact_y, _ = rig.frames.contact_in_base_m
        return cls(
            rig.control,
            AppliedLaw(shipped_law(rig.control) if law is None else law),
            rig.ft.noise,
            rig.ft.declared.range,
            rig.ft.declared.resolution,
            StraightPath.of(rig.path.origin_m, rig.path.direction_deg),
            rig.frames.base_from_sensor,
            contact_x,
            contact_y,
            rig.path.expected_contact_m,
            max(rig.control.ramp_s, rig.control.push_speed_m_per_s / rig.limits.max_acceleration_m_per_s2),
            1.0 / rig.loop.rate_hz,
            round(rig.ft.declared.rate_hz * rig.ft.tare_s),
            round(rig.ft.declared.rate_hz * min(rig.ft.tare_s, CHECK_S)),
            max(SMALLEST_COUNT, round(SETTLE_S * rig.ft.declared.rate_hz)),
            max(1, round(rig.control.contact_samples * rig.ft.declared.rate_hz / CONTACT_RATE_HZ)),
            in_contact,
            rig.scatters,
        )
