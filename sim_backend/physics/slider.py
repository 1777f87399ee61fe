"""The slider model: its shape, the floor's friction under it, and the friction at the contact.

An impossible slider is a `ConfigError` of one sentence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from robot_io.errors import ConfigError
from sim_backend.physics.shapes import Circle, ConvexPolygon, Point, Rectangle, Shape, positive
from sim_backend.physics.support import MOST_POINTS, SCALE_OF_UNIFORM, Pressure, centre_of, support_points

__all__ = ["Circle", "ConvexPolygon", "Pressure", "Rectangle", "Shape", "SliderModel", "pressure_distance_m"]

STANDARD_GRAVITY_M_PER_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class SliderModel:
    """A slider as the quasistatic model sees it: shape, ellipsoid of floor friction, contact friction.

    f_max_N, tau_max_Nm: the greatest friction force and torque of the floor (semi-axes of the limit surface).
    contact_friction: coefficient between pusher and slider. cof_m: centre of friction, BODY frame.
    """

    shape: Shape
    f_max_N: float
    tau_max_Nm: float
    contact_friction: float
    cof_m: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name, value in (("f_max_N", self.f_max_N), ("tau_max_Nm", self.tau_max_Nm)):
            if not positive(value):
                raise ConfigError(f"{name} = {value} is not a positive, finite number", where="slider")
        if not (math.isfinite(self.contact_friction) and self.contact_friction >= 0):
            raise ConfigError(f"contact friction {self.contact_friction} is not a number of at least 0", where="slider")
        if not (all(map(math.isfinite, self.cof_m)) and self.shape.contains(self.cof_m)):
            raise ConfigError(f"the centre of friction {self.cof_m} lies outside the slider", where="slider")

    @property
    def d_m(self) -> float:
        """Length tau_max / f_max: with the contact friction, all that the motion depends on."""
        return self.tau_max_Nm / self.f_max_N

    @classmethod
    def from_mass(
        cls,
        shape: Shape,
        *,
        mass_kg: float,
        floor_friction: float,
        contact_friction: float,
        pressure: Pressure = "uniform",
        cof_m: Point | None = None,
    ) -> SliderModel:
        """Return the model of a body of `mass_kg` on a floor.

        The centre of friction is that of the pressure (a named one's is the centroid) unless given.
        """
        f_max = floor_friction * mass_kg * STANDARD_GRAVITY_M_PER_S2
        cof = cof_m or (shape.centroid_m if isinstance(pressure, str) else centre_of(support_points(shape, pressure)))
        tau_max = f_max * pressure_distance_m(shape, pressure, cof)
        return cls(shape, f_max, tau_max, contact_friction, cof)


def pressure_distance_m(shape: Shape, pressure: Pressure, cof_m: Point | None = None) -> float:
    """Return d = tau_max / f_max (m) of a pressure distribution about the centre of friction (default: centroid).

    `uniform`: mean distance of the support area (the paper's integral); `centre`, `point`: a half and a tenth of that;
    `rim`: all pressure at the greatest distance; any other: the mean distance of its support points. Raises ConfigError
    if the centre of friction lies outside.
    """
    cof = shape.centroid_m if cof_m is None else cof_m
    if not (all(map(math.isfinite, cof)) and shape.contains(cof)):
        raise ConfigError(f"the centre of friction {cof} lies outside the slider", where="slider")
    if pressure == "rim":
        return shape.greatest_distance_m(cof)
    if isinstance(pressure, str) and pressure in SCALE_OF_UNIFORM:
        return SCALE_OF_UNIFORM[pressure] * shape.mean_distance_m(cof)
    points = support_points(shape, pressure, MOST_POINTS, cof)
    return math.fsum(w * math.hypot(x - cof[0], y - cof[1]) for x, y, w in points)
