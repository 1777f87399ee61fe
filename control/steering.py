"""Asks the law where to push: what it sees, and what becomes of what it says. Pure if the law is."""

from __future__ import annotations

import math

from msgspec.structs import replace

from control import push_law
from control.laws.law import Seen
from control.settings import Settings
from robot_io.tick import ControlState, TickInput

SIDEWAYS_RAD = math.pi / 2
"""A law that asks for more is followed as far as this: sideways, never backward (docs/laws.md)."""
BACKWARD_RAD = math.radians(135.0)
"""... and not at all beyond this, where it is the force that points backward."""


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
    way_m, backward = 0.0, 0
    if abs(theta_p) > SIDEWAYS_RAD:  # safety bounds the way (F56-way)
        way_m = state.sideways_m + speed * seen.dt_s
    if abs(theta_p) > BACKWARD_RAD:  # the direction is kept, and safety counts the ticks (F56)
        backward, theta_p = state.backward_ticks + 1, state.theta_p
    theta_p = math.copysign(min(abs(theta_p), SIDEWAYS_RAD), theta_p)
    # Not a number: F58 at once.
    return replace(
        state,
        theta_f=theta_f,
        law_state=said.state,
        theta_p=theta_p,
        speed=speed,
        backward_ticks=backward,
        sideways_m=way_m,
    )
