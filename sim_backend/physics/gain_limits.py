"""The largest k_y at which a straight push does not start to weave: linear stability of the law, in closed form.

Linearised about the straight push, with rho from contact to centre of mass along the push, d the length that resists
turning (d^2 the mean square distance of the pressure along the push; tau_max/f_max is pessimistic), R the ball's
radius, L the pressure's shift (floor friction times push height) and a the floor's friction along over across the path;
kappa = k_f + 1 - a^2:

    box, sticking        k_y < kappa (rho - R) / (a^2 d^2 + rho (rho + L))
    box, frictionless    (H/d^2 - k_y)(kappa - H k_y) > a^2 k_y,   H = rho + L + R
    circle, sticking     k_y < kappa rho^2/(rho + R) / (a^2 d^2 + rho (rho + L))
    circle, frictionless k_y < kappa / (rho + R)

The law's y_c is that of the ball's centre. Derived in docs/laws.md; R = L = 0, a = 1 is the paper's point pusher on an
even floor.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import radians, sqrt

import msgspec

WARN_SHARE = 0.7
"""Gains beyond this share of the limit leave too little for what is not modelled."""


class PushedBody(msgspec.Struct, frozen=True):
    """One slider, described for the limits: m. `rho_m`: half its length along the push, or its radius."""

    round: bool
    rho_m: float
    d_m: float
    ball_radius_m: float = 0.0
    shift_m: float = 0.0
    along_over_across: float = 1.0


def sticking_limit(body: PushedBody, k_f: float) -> float:
    """Return the greatest stable k_y (rad/m) while the contact sticks; 0 or less: no k_y is stable."""
    kappa = _kappa(body, k_f)
    rho, ball = body.rho_m, body.ball_radius_m
    lever = rho * rho / (rho + ball) if body.round else rho - ball
    return kappa * lever / (body.along_over_across**2 * body.d_m**2 + rho * (rho + body.shift_m))


def frictionless_limit(body: PushedBody, k_f: float) -> float:
    """Return the greatest stable k_y (rad/m) of a contact without friction; 0 or less: no k_y is stable."""
    kappa = _kappa(body, k_f)
    rho, ball = body.rho_m, body.ball_radius_m
    if body.round:
        return kappa / (rho + ball)
    if kappa <= 0:
        return kappa
    reach = rho + body.shift_m + ball
    per_d2 = 1 / body.d_m**2
    # reach k_y^2 - b k_y + c > 0 below its smaller root
    b = reach * reach * per_d2 + kappa + body.along_over_across**2
    c = reach * kappa * per_d2
    return 2 * c / (b + sqrt(max(b * b - 4 * reach * c, 0.0)))


def limit(bodies: Iterable[PushedBody], k_f: float) -> float:
    """Return the greatest k_y (rad/m) that is stable for every body, whatever the contact friction.

    0 or less: no k_y is stable, in particular for a k_f at which the force angle itself runs away (`fast_loop_k_f`).
    """
    bodies = tuple(bodies)
    if k_f >= fast_loop_k_f(bodies):
        return 0.0
    return min(min(sticking_limit(body, k_f), frictionless_limit(body, k_f)) for body in bodies)


def fast_loop_k_f(bodies: Iterable[PushedBody]) -> float:
    """Return the k_f above which the force angle itself runs away from sample to sample while the contact sticks.

    The force angle responds to the pushing angle with the slope 1 / (a^2 + rho (rho + L) / d^2), and the law feeds it
    back with k_f + 1: their product must stay below 1.
    """
    return min(1 / _slope(body) - 1 for body in bodies)


def decay_per_m(bodies: Iterable[PushedBody], k_f: float, k_y_rad_per_m: float) -> float:
    """Return how fast a disturbance of the straight push decays at least, as a rate per m pushed; 0: it may not decay.

    The slowest pole over these bodies of the sticking contact and, for a circle, of the frictionless one.
    """
    rates = [0.0] if k_f >= fast_loop_k_f(bodies := tuple(bodies)) else []
    for body in bodies if not rates else ():
        slope = _slope(body)
        fast = 1 - (1 + k_f) * slope
        rates.append(
            _slowest(
                (sticking_limit(body, k_f) - k_y_rad_per_m) / fast, k_y_rad_per_m * (1 - slope) / fast / body.rho_m
            )
        )
        if body.round:
            rates.append(_slowest(frictionless_limit(body, k_f) - k_y_rad_per_m, k_y_rad_per_m / body.rho_m))
    return max(min(rates), 0.0)


def _slowest(damping: float, stiffness: float) -> float:
    """Return the smaller decay of the roots of L^2 + damping L + stiffness = 0."""
    return (damping - sqrt(max(damping * damping - 4 * stiffness, 0.0))) / 2


def _slope(body: PushedBody) -> float:
    """Return by how much the force angle answers the pushing angle while the contact sticks."""
    return 1 / (body.along_over_across**2 + body.rho_m * (body.rho_m + body.shift_m) / body.d_m**2)


def integral_limit(bodies: Iterable[PushedBody], k_f: float, k_y_rad_per_m: float) -> float:
    """Return the greatest k_i (rad/m^2) of the law with integral that is stable for every body.

    0: none is, because the paper's law with these gains is not. Derived in docs/laws.md.
    """
    bodies = tuple(bodies)
    if k_y_rad_per_m >= limit(bodies, k_f):
        return 0.0
    return min(
        min(sticking_integral_limit(body, k_f, k_y_rad_per_m), frictionless_integral_limit(body, k_f, k_y_rad_per_m))
        for body in bodies
    )


def sticking_integral_limit(body: PushedBody, k_f: float, k_y: float) -> float:
    """Return the greatest stable k_i (rad/m^2) while the contact sticks, for a k_y that is stable without it."""
    slope = body.along_over_across**2 + body.rho_m * (body.rho_m + body.shift_m) / body.d_m**2
    p = slope / (slope - k_f - 1)
    m = p * sticking_limit(body, k_f)
    return _third_order_limit(m, p, body.along_over_across**2 * m / _kappa(body, k_f), k_y)


def frictionless_integral_limit(body: PushedBody, k_f: float, k_y: float) -> float:
    """Return the greatest stable k_i (rad/m^2) of a contact without friction, for a k_y that is stable without it."""
    kappa, square = _kappa(body, k_f), body.along_over_across**2
    if body.round:
        reach = body.rho_m + body.ball_radius_m
        return _third_order_limit(kappa / reach, 1.0, square / reach, k_y)
    h = (body.rho_m + body.shift_m + body.ball_radius_m) / body.d_m**2
    e, n = square / body.d_m**2, kappa / body.d_m**2
    a, b, a3 = n - k_y * h, k_y * e, h - k_y
    # h k_y k_i^2 + linear k_i < free, below its positive root
    linear, free = a3 * (a * h + b) - 2 * b * h + a3 * a3 * e, b * (a3 * a - b)
    return 2 * free / (linear + sqrt(linear * linear + 4 * h * k_y * free))


def _third_order_limit(m: float, p: float, r: float, k_y: float) -> float:
    left = m - p * k_y
    return r * k_y * left / (r + p * left)


def offset_per_degree_m(k_f: float, k_y_rad_per_m: float) -> float:
    """Return the steady lateral offset (m) that one degree of error in the force's angle costs."""
    return (1 + k_f) / k_y_rad_per_m * radians(1)


def offset_per_newton_m(k_f: float, k_y_rad_per_m: float, slide_force_N: float) -> float:
    """Return the steady lateral offset (m) that one newton of lateral bias costs at a given sliding force."""
    return (1 + k_f) / k_y_rad_per_m / slide_force_N


def _kappa(body: PushedBody, k_f: float) -> float:
    return k_f + 1 - body.along_over_across**2
