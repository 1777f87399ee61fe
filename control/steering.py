"""Asks the law where to push: what it sees, and what becomes of what it says. Pure if the law is."""

from __future__ import annotations

import math

from msgspec.structs import replace

from control import push_law
from control.laws.law import Seen
from control.settings import Settings
from robot_io.tick import ControlState, TickInput

BACKWARD_RAD = math.pi / 2


def steer(
    settings: Settings, state: ControlState, inp: TickInput, force: tuple[float, float], speed: float
) -> ControlState:
    """Return the state after the law was asked for the direction of the push.

    force: on the object, N, PATH frame. speed: of the push, m/s. A law that failed once is not asked again (F57).
    """
    if state.law_error:
        return replace(state, speed=0.0)
    theta_f = push_law.force_angle(*force)
    twist = inp.base.odometry
    measured = math.hypot(twist.vx, twist.vy)
    seen = Seen(
        *force,
        state.force_valid,
        theta_f,
        state.lateral_m,
        state.progress_m,
        measured if math.isfinite(measured) else 0.0,
        settings.period_s * (1 + inp.host.skipped),
    )
    said = settings.law.step(state.law_state, seen)
    if said.error:
        return replace(state, theta_f=theta_f, law_error=said.error, speed=0.0)
    theta_p = said.theta_p_rad if math.isfinite(said.theta_p_rad) else math.nan
    if abs(theta_p) > BACKWARD_RAD:
        # Beyond 90 degrees the law would pull: the direction is kept and safety counts the ticks (F56).
        backward = state.backward_ticks + 1
        return replace(state, theta_f=theta_f, law_state=said.state, speed=speed, backward_ticks=backward)
    # Not a number: F58 at once.
    return replace(state, theta_f=theta_f, law_state=said.state, theta_p=theta_p, speed=speed, backward_ticks=0)
