"""The settings that safety takes from a rig file, resolved once."""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import Joints, Vector6
from robot_io.rig.config import FtConfig, RigConfig
from safety.envelope import EnvelopeLimits
from safety.limits import MAX_TURN_RATE_RAD_PER_S, speed_limit_m_per_s
from safety.motion_bounds import PhaseBounds, phase_bounds, total_bounds
from safety.workspace import WorkspaceSettings

SATURATED = 0.95
"""Share of the sensor's range."""
FROZEN_S = 0.3
"""Readings that stay equal for this long, at the sensor's declared rate, are a fault."""


class SafetySettings(msgspec.Struct, frozen=True, gc=False):
    """Limits in SI units and times in ns."""

    period_ns: int
    max_force: float
    slow_force: float
    max_torque: float
    saturated: Vector6
    """Readings at or above which an axis counts as saturated: N, N*m."""
    frozen_readings: int
    """This many consecutive equal readings are a fault."""
    noise_floor: bool
    """Whether the sensor's readings are noisy enough that equal ones are a fault."""
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
            limits.max_force_N,
            limits.slow_force_N,
            limits.max_torque_Nm,
            (fx * SATURATED, fy * SATURATED, fz * SATURATED, mx * SATURATED, my * SATURATED, mz * SATURATED),
            round(FROZEN_S * rig.ft.declared.rate_hz),
            _scatters(rig.ft),
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
            bounds.distance_m,
            bounds.moving_s,
            WorkspaceSettings.of(rig),
            phase_bounds(rig),
            rig.base.pose_source == "odometry",
        )


def _scatters(ft: FtConfig) -> bool:
    """Return whether 30 consecutive equal readings cannot be chance.

    They cannot where the noise of an axis is at least one step of its resolution: then at most 0.38 of the readings
    have the most frequent value, and 0.38^30 is 3e-13. With half a step it is 1e-5, a false stop every hour.
    """
    axes = zip(ft.noise, ft.declared.resolution, strict=True)
    return ft.noise_force_N != 0.0 and any(noise >= step for noise, step in axes)
