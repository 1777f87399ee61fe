"""The last pure step before the gate: speed clamp, rate limit, and the reaction of the mode.

The envelope never turns a velocity: clamps scale the whole vector, so that a push stays a push in its direction.
"""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import BodyTwist
from robot_io.tick import EnvelopeState, Mode

SLOW_FACTOR = 0.5
"""In SLOW, at most half of what control wants."""


class EnvelopeLimits(msgspec.Struct, frozen=True, gc=False):
    """m/s, rad/s, m/s^2, rad/s^2, and the tick's period in s."""

    speed: float
    turn_rate: float
    acceleration: float
    turn_acceleration: float
    period_s: float


def apply(
    limits: EnvelopeLimits, state: EnvelopeState, wanted: BodyTwist, mode: Mode
) -> tuple[EnvelopeState, BodyTwist]:
    """Return the command for the gate, in the BODY frame, and the new state.

    SILENT, READY, STOP and DEAD give zero this tick. HOLD ramps to zero at the acceleration limit. SLOW halves.
    A velocity that is not finite gives zero (and is a fault of its own, F58).
    """
    if mode in (Mode.SILENT, Mode.READY, Mode.STOP, Mode.DEAD):
        return EnvelopeState(BodyTwist(), state.clamps, False), BodyTwist()
    vx, vy, omega = wanted.vx, wanted.vy, wanted.omega
    if mode == Mode.HOLD or not (math.isfinite(vx) and math.isfinite(vy) and math.isfinite(omega)):
        vx = vy = omega = 0.0
    elif mode == Mode.SLOW:
        vx, vy, omega = vx * SLOW_FACTOR, vy * SLOW_FACTOR, omega * SLOW_FACTOR
    clamped = False
    speed = math.hypot(vx, vy)
    if speed > limits.speed:
        vx, vy = vx * limits.speed / speed, vy * limits.speed / speed
        clamped = True
    if abs(omega) > limits.turn_rate:
        omega = math.copysign(limits.turn_rate, omega)
        clamped = True
    vx, vy = _towards(state.last.vx, state.last.vy, vx, vy, limits.acceleration * limits.period_s)
    step = limits.turn_acceleration * limits.period_s
    omega = state.last.omega + min(max(omega - state.last.omega, -step), step)
    command = BodyTwist(vx, vy, omega)
    return EnvelopeState(command, state.clamps + clamped, clamped), command


def _towards(x: float, y: float, to_x: float, to_y: float, step: float) -> tuple[float, float]:
    distance = math.hypot(to_x - x, to_y - y)
    if distance <= step:
        return to_x, to_y
    return x + (to_x - x) * step / distance, y + (to_y - y) * step / distance
