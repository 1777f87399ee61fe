"""The last pure step before the gate: the reaction of the mode, speed clamps, rate limit.

Base and contact ball are bounded by the same speed: the ball sits about a metre in front, so that a turn moves it.

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
    contact_x: float
    contact_y: float
    """Centre of the contact ball in the BODY frame, m: it may be no faster than the base."""


def too_fast(limits: EnvelopeLimits, measured: BodyTwist) -> bool:
    """Return whether a measured velocity (BODY frame) is beyond the limits and their margin; True for NaN."""
    return not (
        math.hypot(measured.vx, measured.vy) <= OVERSPEED_FACTOR * limits.speed
        and abs(measured.omega) <= OVERSPEED_FACTOR * limits.turn_rate
    )


def contact_speed(limits: EnvelopeLimits, twist: BodyTwist) -> float:
    """Return the speed of the contact ball, m/s, for a velocity of the base (BODY frame)."""
    return math.hypot(twist.vx - twist.omega * limits.contact_y, twist.vy + twist.omega * limits.contact_x)


def reduces(new: BodyTwist, old: BodyTwist) -> bool:
    """Return whether every component moves towards zero or stays the same."""
    return all(
        abs(b) <= abs(a) and a * b >= 0.0 for a, b in ((old.vx, new.vx), (old.vy, new.vy), (old.omega, new.omega))
    )


def is_number(twist: BodyTwist) -> bool:
    """Return whether all three numbers of a velocity are finite."""
    return math.isfinite(twist.vx) and math.isfinite(twist.vy) and math.isfinite(twist.omega)


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
    wish = BodyTwist(vx, vy, omega)
    if contact_speed(limits, wish) > limits.speed:
        wish = _slowed(limits, wish)
        clamped = True
    command = _stepped(limits, state.last, wish)
    return EnvelopeState(command, state.clamps + clamped, clamped), command


def _slowed(limits: EnvelopeLimits, twist: BodyTwist) -> BodyTwist:
    """Return the twist scaled as a whole so that the contact ball is no faster than allowed."""
    share = limits.speed / contact_speed(limits, twist)
    return BodyTwist(twist.vx * share, twist.vy * share, twist.omega * share)


def _stepped(limits: EnvelopeLimits, last: BodyTwist, wish: BodyTwist) -> BodyTwist:
    """Return the command one tick from `last` towards `wish`, both within the limits of base and contact ball."""
    period_s = limits.period_ns * 1e-9
    step, turn_step = limits.acceleration * period_s, limits.turn_acceleration * period_s
    vx, vy = _towards(last.vx, last.vy, wish.vx, wish.vy, step)
    command = BodyTwist(vx, vy, last.omega + min(max(wish.omega - last.omega, -turn_step), turn_step))
    if contact_speed(limits, command) <= limits.speed:
        return command
    slowed = _slowed(limits, command)
    if reduces(slowed, last):
        return slowed
    # Scaled, another component may jump. On the straight line from `last` to `wish` the ball keeps its limit anyway.
    away, turn_away = math.hypot(wish.vx - last.vx, wish.vy - last.vy), abs(wish.omega - last.omega)
    share = min(step / max(away, step), turn_step / max(turn_away, turn_step))
    straight = BodyTwist(
        last.vx + share * (wish.vx - last.vx),
        last.vy + share * (wish.vy - last.vy),
        last.omega + share * (wish.omega - last.omega),
    )
    return _slowed(limits, straight) if contact_speed(limits, straight) > limits.speed else straight


def _towards(x: float, y: float, to_x: float, to_y: float, step: float) -> tuple[float, float]:
    distance = math.hypot(to_x - x, to_y - y)
    if distance <= step:
        return to_x, to_y
    return x + (to_x - x) * step / distance, y + (to_y - y) * step / distance
