"""The last pure step before the gate: speed clamp, rate limit, and the reaction of the mode.

The envelope never rotates a velocity: clamps scale the complete vector, so that the push keeps its direction.
"""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import BodyTwist
from robot_io.tick import EnvelopeState, Mode

SLOW_FACTOR = 0.5
"""In SLOW, half of the velocity that control wants."""


OVERSPEED_FACTOR = 1.3
"""A measured speed may exceed the limit by this much (noise, overshoot of the wheels) before it counts as too fast."""


class EnvelopeLimits(msgspec.Struct, frozen=True, gc=False):
    """Limits that the envelope applies and the gate enforces: m/s, rad/s, m/s^2, rad/s^2; the tick's period in ns."""

    speed: float
    turn_rate: float
    acceleration: float
    turn_acceleration: float
    period_ns: int


def too_fast(limits: EnvelopeLimits, measured: BodyTwist) -> bool:
    """Return whether a measured velocity (BODY frame) is beyond the limits and their margin; True for NaN."""
    return not (
        math.hypot(measured.vx, measured.vy) <= OVERSPEED_FACTOR * limits.speed
        and abs(measured.omega) <= OVERSPEED_FACTOR * limits.turn_rate
    )


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
    period_s = limits.period_ns * 1e-9
    vx, vy = _towards(state.last.vx, state.last.vy, vx, vy, limits.acceleration * period_s)
    step = limits.turn_acceleration * period_s
    omega = state.last.omega + min(max(omega - state.last.omega, -step), step)
    command = BodyTwist(vx, vy, omega)
    return EnvelopeState(command, state.clamps + clamped, clamped), command


def _towards(x: float, y: float, to_x: float, to_y: float, step: float) -> tuple[float, float]:
    distance = math.hypot(to_x - x, to_y - y)
    if distance <= step:
        return to_x, to_y
    return x + (to_x - x) * step / distance, y + (to_y - y) * step / distance
