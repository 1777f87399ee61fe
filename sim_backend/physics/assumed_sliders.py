"""The sliders for which gains are checked: turns a rig's known ranges into the bodies whose limits count."""

from __future__ import annotations

from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.gain_limits import PushedBody
from sim_backend.physics.slider import Circle, Pressure, Rectangle, SliderModel, pressure_distance_m

SAMPLES = 5
"""Number of sizes taken from a range, including its ends."""


def samples(low_m: float, high_m: float) -> list[float]:
    """Return evenly spaced sizes from `low_m` to `high_m`, both included (a single one if they are equal)."""
    if low_m == high_m:
        return [low_m]
    return [low_m + (high_m - low_m) * i / (SAMPLES - 1) for i in range(SAMPLES)]


def pushed_body(
    outline: Circle | Rectangle, pressure: Pressure, effects: FloorEffects, ball_radius_m: float
) -> PushedBody:
    """Return the limits' body of a slider pushed straight at its middle. Raises ConfigError when it tips over."""
    model = SliderModel(outline, 1.0, pressure_distance_m(outline, pressure), 1.0)
    _, _, d, _, _ = Floor(model, pressure, effects).grip(0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    is_round = isinstance(outline, Circle)
    rho = outline.radius_m if isinstance(outline, Circle) else max(x for x, _ in outline.corners)
    return PushedBody(is_round, rho, d, ball_radius_m, effects.shift_m, effects.along_over_across)
