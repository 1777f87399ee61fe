"""The sliders for which gains are checked: turns ranges of what one expects into the bodies whose limits count."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from typing import Literal

import msgspec

from robot_io.errors import ConfigError
from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.gain_limits import PushedBody
from sim_backend.physics.slider import Circle, Pressure, Rectangle, SliderModel, pressure_distance_m

Turning = Literal["ellipsoid", "along-push", "coulomb"]
SAMPLES = 5
"""Number of sizes taken from a range, including its ends."""


class AssumedSlider(msgspec.Struct, frozen=True):
    """A slider, pushed straight at its middle by a ball; `effects.turning` is what it is judged by."""

    outline: Circle | Rectangle
    pressure: Pressure
    effects: FloorEffects
    ball_radius_m: float

    def body(self) -> PushedBody:
        """Return the limits' body. Raises ConfigError when it tips over."""
        model = SliderModel(self.outline, 1.0, pressure_distance_m(self.outline, self.pressure), 1.0)
        _, _, d, _, _ = Floor(model, self.pressure, self.effects).grip(0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
        is_round = isinstance(self.outline, Circle)
        rho = self.outline.radius_m if isinstance(self.outline, Circle) else max(x for x, _ in self.outline.corners)
        shift, grain = self.effects.shift_m, self.effects.along_over_across
        if self.effects.turning != "ellipsoid":
            d /= grain  # turning moves points across the push, where a small motion meets 1 / grain^2 of the friction
        return PushedBody(is_round, rho, d, self.ball_radius_m, shift, grain)

    def pushed(self, turning: Turning, contact_friction: float) -> PushedSlider:
        """Return it at the origin, heading along x, on such a floor. Raises ConfigError if it tips over."""
        model = SliderModel(self.outline, 1.0, pressure_distance_m(self.outline, self.pressure), contact_friction)
        floor = Floor(model, self.pressure, self.on(turning).effects)
        return PushedSlider(model, (0.0, 0.0, 0.0), self.ball_radius_m, floor=floor)

    def on(self, turning: Turning) -> AssumedSlider:
        """Return the same slider judged by another resistance to turning, which is one of `[world.floor] turning`."""
        effects = msgspec.structs.replace(self.effects, turning=turning)
        return msgspec.structs.replace(self, effects=effects)


def samples(low_m: float, high_m: float) -> list[float]:
    """Return evenly spaced sizes from `low_m` to `high_m`, both included (a single one if they are equal)."""
    if low_m == high_m:
        return [low_m]
    return [low_m + (high_m - low_m) * i / (SAMPLES - 1) for i in range(SAMPLES)]


def assumed_sliders(
    outlines: Iterable[Circle | Rectangle], pressures: Sequence[Pressure], effects: FloorEffects, ball_radius_m: float
) -> list[AssumedSlider]:
    """Return a slider for each outline and pressure, without those that tip over: nobody pushes them at that height."""
    sliders = []
    for outline in outlines:
        for pressure in pressures:
            slider = AssumedSlider(outline, pressure, effects, ball_radius_m)
            with contextlib.suppress(ConfigError):
                slider.body()
                sliders.append(slider)
    return sliders


def bodies(sliders: Iterable[AssumedSlider]) -> list[PushedBody]:
    """Return the limits' bodies of sliders."""
    return [slider.body() for slider in sliders]


def pessimistic_bodies(sliders: Iterable[AssumedSlider]) -> list[PushedBody]:
    """Return the same with the ellipsoid's resistance: that of spinning on the spot, more than a push meets."""
    return [slider.on("ellipsoid").body() for slider in sliders]
