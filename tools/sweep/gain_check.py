"""Verify the limits of `sim_backend.physics.gain_limits` by simulation: where a small oscillation begins to grow.

The push is simulated by the world's own model (`contact.PushedSlider` with its floor), the law uses the force of the
previous step, and a search finds the gain at which the growth rate of a small oscillation is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, log, sin

from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.gain_limits import PushedBody
from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import SliderModel

SPEED_M_PER_S = 0.1
LONGEST_STEP_S = 0.004
STEP_SHARE = 0.003
"""Maximum step, as a share of the time to push the slider by half its length: limits the effect of the delay."""
EULER_SHARE = 0.5
"""... and as a share of the time in which a frictionless contact slides back to a face's middle (at most 2)."""
START_OFFSET_M = 1e-4
"""Small, so that the oscillation stays linear."""
SWINGS = 6
"""Number of extremes compared, after the first ones."""
LONGEST_S = 2000.0
STICKING_FRICTION = 2.0


def simulated_limit(body: PushedBody, k_f: float, *, frictionless: bool, near: float) -> float:
    """Return the k_y (rad/m) at which the growth rate of a small oscillation is 0, searched from `near`."""
    return _zero_near(lambda k_y: growth_rate(body, k_f, k_y, frictionless=frictionless), near)


def _zero_near(rate: Callable[[float], float], near: float) -> float:
    low, high = 0.97 * near, 1.03 * near
    rate_low, rate_high = rate(low), rate(high)
    for _ in range(2):  # secant method: the rate is almost linear in the gain
        middle = low - rate_low * (high - low) / (rate_high - rate_low)
        low, rate_low = (high, rate_high) if abs(high - middle) < abs(low - middle) else (low, rate_low)
        high, rate_high = middle, rate(middle)
    return low - rate_low * (high - low) / (rate_high - rate_low)


def simulated_integral_limit(body: PushedBody, k_f: float, k_y: float, *, frictionless: bool, near: float) -> float:
    """Return the k_i (rad/m^2) at which the growth rate of a small oscillation is 0, searched from `near`."""
    return _zero_near(lambda k_i: growth_rate(body, k_f, k_y, k_i, frictionless=frictionless), near)


def growth_rate(
    body: PushedBody, k_f: float, k_y_rad_per_m: float, k_i_rad_per_m2: float = 0.0, *, frictionless: bool
) -> float:
    """Return the growth rate (1/s) of a small oscillation, from the extremes of the ball's lateral position."""
    slider = _slider(body, 0.0 if frictionless else STICKING_FRICTION)
    step_s = _step_s(body, slides=frictionless)
    x, y = -body.rho_m - body.ball_radius_m, START_OFFSET_M
    fx, fy, t = 1.0, 0.0, 0.0
    extremes: list[tuple[float, float]] = []
    old_dy = integral = 0.0
    while len(extremes) < SWINGS + 2 and t < LONGEST_S:
        theta_p = (k_f + 1) * atan2(fy, fx) + k_y_rad_per_m * y + integral
        integral += k_i_rad_per_m2 * y * SPEED_M_PER_S * step_s
        dx, dy = SPEED_M_PER_S * step_s * cos(theta_p), SPEED_M_PER_S * step_s * sin(theta_p)
        outcome = slider.step((x, y), (x + dx, y + dy), step_s)
        x, y, t = x + dx, y + dy, t + step_s
        fx, fy = outcome.force_x, outcome.force_y
        if old_dy * dy < 0:
            extremes.append((t, abs(y)))
        old_dy = dy
    if len(extremes) < 4:
        return log(max(abs(y), 1e-300) / START_OFFSET_M) / t  # no oscillation: it only diverges or decays
    (t_first, first), (t_last, last) = extremes[2], extremes[-1]
    return log(last / first) / (t_last - t_first)


def _step_s(body: PushedBody, *, slides: bool) -> float:
    longest_m = STEP_SHARE * body.rho_m
    if slides and not body.round:
        reach = body.rho_m + body.shift_m + body.ball_radius_m
        longest_m = min(longest_m, EULER_SHARE * body.d_m**2 / reach)
    return min(LONGEST_STEP_S, longest_m / SPEED_M_PER_S)


def _slider(body: PushedBody, contact_friction: float) -> PushedSlider:
    shape = Circle(body.rho_m) if body.round else Rectangle(2 * body.rho_m, 2 * body.rho_m)
    model = SliderModel(shape, 1.0, body.d_m, contact_friction)
    effects = FloorEffects(shift_m=body.shift_m, along_over_across=body.along_over_across)
    return PushedSlider(model, (0.0, 0.0, 0.0), body.ball_radius_m, floor=Floor(model, "uniform", effects))
