"""The numbers of a tick that figures and tables are made of."""

from __future__ import annotations

import math

from robot_io.geometry import StraightPath, wrap_angle
from robot_io.tick import ControlTick, Phase

TICK_COLUMNS = (
    "t_s",
    "along_m",
    "lateral_m",
    "force_x",
    "force_y",
    "force_raw",
    "theta_f",
    "theta_p",
    "speed_wanted",
    "speed_command",
    "speed_measured",
    "heading_error",
    "phase",
)
"""One row per tick; forces in N and angles in rad in the PATH frame, speeds in m/s, heading error in rad.

`along_m` is from the path's origin. `force_raw` is the magnitude of the newest reading minus bias, as safety uses it.
"""


def tick_row(tick: ControlTick, path: StraightPath, time_s: float) -> tuple[float, ...]:
    """Return the row of a tick; NaN for what it does not have."""
    control, output, base = tick.after.control, tick.output, tick.input.base
    raw = math.nan
    if control.tared and tick.input.ft.readings:
        raw = math.dist(tick.input.ft.readings[-1].force, control.bias_force)
    driven = control.phase in (Phase.PUSH, Phase.LOST) and control.force_valid
    turned = base.pose.yaw - control.held_yaw
    held = control.phase >= Phase.APPROACH and math.isfinite(turned)
    return (
        time_s,
        path.along(output.contact_x, output.contact_y),
        path.lateral(output.contact_x, output.contact_y),
        *path.vector_to_path(*control.force_world[:2]),
        raw,
        control.theta_f if driven and control.phase == Phase.PUSH else math.nan,
        control.theta_p if driven else math.nan,
        math.hypot(output.wanted_body.vx, output.wanted_body.vy),
        math.hypot(output.command_body.vx, output.command_body.vy),
        math.hypot(base.odometry.vx, base.odometry.vy),
        wrap_angle(turned) if held else math.nan,
        float(control.phase),
    )
