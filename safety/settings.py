"""The settings that safety takes from a rig file, resolved once."""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import Joints, Vector6
from robot_io.rig.config import RigConfig
from robot_io.rig.types import Matrix3
from safety.envelope import EnvelopeLimits
from safety.limits import MAX_TURN_RATE_RAD_PER_S, speed_limit_m_per_s
from safety.motion_bounds import PhaseBounds, phase_bounds, total_bounds
from safety.workspace import WorkspaceSettings

SATURATED = 0.95
"""Share of the sensor's range."""
FROZEN_S = 0.3
"""Readings that stay equal for this long, at the sensor's declared rate, are a fault."""

DAMAGED_S = 0.2
DAMAGED_SHARE = 0.25
"""One in four packets damaged over this time, at the sensor's declared rate: the line is bad, not the packet."""
LOW_RATE_SHARE, LEAST_RATE_SHARE = 0.55, 0.4
"""Shares of the sensor's declared rate: the authors of the paper saw 63 of 100 Hz arrive."""


class SafetySettings(msgspec.Struct, frozen=True, gc=False):
    """Limits in SI units and times in ns."""

    period_ns: int
    law_ns: int
    """A step of the law may take this long."""
    law_ms: float
    max_force: float
    slow_force: float
    max_torque: float
    saturated: Vector6
    """Readings at or above which an axis counts as saturated: N, N*m."""
    frozen_readings: int
    """This many consecutive equal readings are a fault."""
    scatters: tuple[bool, bool, bool, bool, bool, bool]
    """Whether the readings of each axis scatter, so that equal ones are a fault."""
    same: Vector6
    """Two readings closer than this are equal: N, N*m."""
    held_pose: Joints
    """Where the arm must be, rad: the frames of the rig are given for this pose."""
    held_pose_tolerance: float
    drift_hold: float
    drift_stop: float
    servo: bool
    max_heading_error: float
    pose_period_ns: int
    push_speed: float
    envelope: EnvelopeLimits
    damaged_packets: int
    """This many damaged packets within the window of F04 are a fault."""
    low_rate: float
    least_rate: float
    """Rates of the sensor below which it is told, and at which the base is held, Hz."""
    base_from_sensor: Matrix3
    total_travel: float
    total_moving: float
    """What the whole run can need, m and s; the gate latches beyond it."""
    workspace: WorkspaceSettings
    phases: PhaseBounds
    pose_is_odometry: bool
    """Whether the pose is counted by the wheels, so that odometry cannot speak against it."""

    @classmethod
    def of(cls, rig: RigConfig) -> SafetySettings:
        """Resolve the settings of a rig."""
        limits = rig.limits
        period_ns = round(1e9 / rig.loop.rate_hz)
        bounds = total_bounds(rig)
        contact_x, contact_y, _ = rig.frames.contact_in_base_m
        fx, fy, fz, mx, my, mz = rig.ft.declared.range
        return cls(
            period_ns,
            round(limits.law_ms * 1e6),
            limits.law_ms,
            limits.max_force_N,
            limits.slow_force_N,
            limits.max_torque_Nm,
            (fx * SATURATED, fy * SATURATED, fz * SATURATED, mx * SATURATED, my * SATURATED, mz * SATURATED),
            round(FROZEN_S * rig.ft.declared.rate_hz),
            rig.scatters,
            _half(rig.ft.declared.resolution),
            rig.arm.held_pose_rad,
            rig.arm.held_pose_tolerance_rad,
            limits.drift_hold_rad,
            limits.drift_stop_rad,
            rig.arm.hold == "servo",
            math.radians(limits.max_heading_error_deg),
            round(1e9 / rig.base.pose_rate_hz),
            rig.control.push_speed_m_per_s,
            EnvelopeLimits(
                speed_limit_m_per_s(rig),
                MAX_TURN_RATE_RAD_PER_S,
                limits.max_acceleration_m_per_s2,
                limits.max_yaw_acceleration_rad_per_s2,
                period_ns,
                contact_x,
                contact_y,
            ),
            math.ceil(DAMAGED_SHARE * DAMAGED_S * rig.ft.declared.rate_hz),
            LOW_RATE_SHARE * rig.ft.declared.rate_hz,
            LEAST_RATE_SHARE * rig.ft.declared.rate_hz,
            rig.frames.base_from_sensor,
            bounds.distance_m,
            bounds.moving_s,
            WorkspaceSettings.of(rig),
            phase_bounds(rig),
            rig.base.pose_source == "odometry",
        )


def _half(steps: Vector6) -> Vector6:
    a, b, c, d, e, f = steps
    return a / 2, b / 2, c / 2, d / 2, e / 2, f / 2
