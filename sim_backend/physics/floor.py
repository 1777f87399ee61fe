"""The floor under a pushed slider, beyond the paper's ellipsoid with a fixed centre.

Four effects, each off unless given: the pressure's centre runs ahead of the centre of mass when the push is above the
floor; what resists turning is the pressure's spread along the push, or Coulomb friction point by point, instead of the
ellipsoid; the floor resists more along one direction; and its friction varies from place to place.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, inf, sin, sqrt
from typing import TYPE_CHECKING, Literal

import msgspec

from robot_io.errors import ConfigError
from sim_backend.physics.floor_patches import FrictionField
from sim_backend.physics.shapes import Circle, Moment, Point, Shape
from sim_backend.physics.slider import Pressure, SliderModel
from sim_backend.physics.slider_exact import ContactSolver, Grain
from sim_backend.physics.support import MOST_POINTS, SCALE_OF_UNIFORM, SUPPORT_POINTS, centre_of, support_points

if TYPE_CHECKING:
    from sim_backend.physics.coulomb.floor import CoulombFloor

Grip = tuple[float, float, float, float, Grain | None]
"""Current centre of friction x, y (m, BODY), d (m), f_max (N) and grain (BODY)."""

SUPPORT_ACROSS = 6
"""The pressure on a floor of patches is sampled at the points of a grid with this many per side."""
LIFTED = 2 / 3
"""What is left of an even pressure's spread when a side begins to lift: along-push goes no lower."""
LOOK_AGAIN_M = 0.002
"""The patches under the slider are looked up again after one of its points has moved about this far."""


class FloorEffects(msgspec.Struct, frozen=True):
    """Which effects are present and how strong they are.

    shift_m: how far the centre of friction runs ahead along the push force: floor friction times push height.
    turning: `ellipsoid` takes d from the greatest torque (right for spinning on the spot); `along-push` from the
    pressure's mean square distance along the push (right for small turns while sliding straight); `coulomb` is the sum
    over support points (right for both).
    along_over_across: friction along `grain_rad` (WORLD) over friction across it; f_max is the one along.
    patch_strength (0 to below 1), patch_m, seed: see `FrictionField`.
    """

    shift_m: float = 0.0
    turning: Literal["ellipsoid", "along-push", "coulomb"] = "ellipsoid"
    along_over_across: float = 1.0
    grain_rad: float = 0.0
    patch_strength: float = 0.0
    patch_m: float = 0.3
    seed: int = 0

    @property
    def has_none(self) -> bool:
        """Return whether this is the paper's floor."""
        return (self.shift_m, self.turning, self.along_over_across, self.patch_strength) == (0.0, "ellipsoid", 1.0, 0.0)


class Floor:
    """The floor's grip on a slider at a pose. Raises ConfigError for effects that are impossible for this slider.

    points: about how many support points stand for the pressure where `turning` is `coulomb`.
    """

    def __init__(
        self, model: SliderModel, pressure: Pressure, effects: FloorEffects, points: int = SUPPORT_POINTS
    ) -> None:
        if not 0 <= effects.shift_m < _room(model.shape, model.cof_m):
            raise ConfigError(
                f"a slider whose pressure moves {effects.shift_m:.3g} m ahead tips over", where="slider",
                do="Push lower, or lower the floor's friction",
            )  # fmt: skip
        if not 0 < effects.along_over_across < inf:
            raise ConfigError(f"{effects.along_over_across} is not a ratio of frictions", where="floor")
        if not (0 <= effects.patch_strength < 1 and 0 < effects.patch_m < inf):
            raise ConfigError("floor patches need a strength from 0 to below 1 and a size", where="floor")
        self._effects, self._has_grain = effects, effects.along_over_across != 1.0
        self._cof, self._d, self._f_max, self._shift_m = model.cof_m, model.d_m, model.f_max_N, effects.shift_m
        middle = model.shape.centroid_m if isinstance(pressure, str) else model.cof_m
        self._off_x, self._off_y = model.cof_m[0] - middle[0], model.cof_m[1] - middle[1]
        self._moment = _pressure_moment(model.shape, pressure) if effects.turning == "along-push" else None
        self.follows_push = effects.shift_m > 0 or self._moment is not None
        self.coulomb: CoulombFloor | None = None
        self._patches: Callable[[float, float, float, float], tuple[float, float, float, float]] | None = None
        field = None
        if effects.patch_strength > 0:
            field = FrictionField(effects.patch_strength, effects.patch_m, effects.seed)
        if effects.turning == "coulomb":
            from sim_backend.physics.coulomb.floor import CoulombFloor  # numba takes long to load: only on request

            own = support_points(model.shape, pressure, points)
            self.coulomb = CoulombFloor(own, model.cof_m, effects.shift_m, field)
        elif field is not None:
            sampled = model.shape.rim_points() if pressure == "rim" else model.shape.grid_points(SUPPORT_ACROSS)
            self._patches = _Patches(model, sampled, field)

    @property
    def steady(self) -> tuple[float, float, float, float, float, float] | None:
        """Return moments and shift as `resisting_d` takes them, None where the grip follows more than the push."""
        if self._moment is None or self._patches is not None or self._has_grain:
            return None
        return (*self._moment, self._shift_m, self._off_x, self._off_y)

    def own_solver(self, asked: str, point_on_polygon: bool) -> ContactSolver | None:
        """Return what solves a contact on this floor, None where an ellipsoid's solvers do.

        asked: the solver of the rig. Raises ConfigError for what Coulomb friction is not for.
        """
        if self.coulomb is None:
            return None
        if asked != "exact":
            raise ConfigError(
                "the paper's program has an ellipsoid of friction, not support points",
                where="world.solver",
                do='Leave solver = "exact" with turning = "coulomb"',
            )
        if point_on_polygon:
            raise ConfigError("a point pusher is not for Coulomb friction", do="Give the ball a radius")
        return self.coulomb.contact

    def grip(self, x: float, y: float, cos_: float, sin_: float, push_x: float, push_y: float) -> Grip:
        """Return the grip on the slider at a pose (m; cosine, sine of its heading), pushed along a BODY direction."""
        if self.coulomb is not None:
            self.coulomb.load(x, y, cos_, sin_, push_x, push_y)
            return (*self.coulomb.centre_m, self._d, self._f_max, self._grain(cos_, sin_))
        d, f_max, shift_m = self._d, self._f_max, self._shift_m
        cof_x, cof_y = self._cof
        if self._moment is not None:
            d = resisting_d(push_x, push_y, *self._moment, shift_m, self._off_x, self._off_y)
        if self._patches is not None:
            shift_x, shift_y, load, spread = self._patches(x, y, cos_, sin_)
            cof_x, cof_y, f_max, d = cof_x + shift_x, cof_y + shift_y, f_max * load, d * spread
        grain = self._grain(cos_, sin_) if self._has_grain else None
        return (cof_x + shift_m * push_x, cof_y + shift_m * push_y, d, f_max, grain)

    def _grain(self, cos_: float, sin_: float) -> Grain | None:
        """Return the floor's grain in BODY axes: 1 along its direction, the squared ratio across."""
        ratio = self._effects.along_over_across
        if ratio == 1.0:
            return None
        c0, s0 = cos(self._effects.grain_rad), sin(self._effects.grain_rad)
        c, s = c0 * cos_ + s0 * sin_, s0 * cos_ - c0 * sin_  # the direction, BODY
        across = ratio * ratio
        return (c * c + across * s * s, (1.0 - across) * c * s, s * s + across * c * c)


def resisting_d(
    ux: float, uy: float, xx: float, xy: float, yy: float, shift: float, off_x: float, off_y: float
) -> float:
    """Return d (m) of a floor that resists turning along the push, for a push along the unit vector u (BODY).

    xx, xy, yy: the pressure's moments (m^2). shift, off: how far its centre moves with the push (m).
    """
    dd = xx * ux * ux + 2.0 * xy * ux * uy + yy * uy * uy
    lean = shift + off_x * ux + off_y * uy
    return sqrt(max(dd - lean * lean, dd * LIFTED))


class _Patches:
    """The slider's pressure at sample points on a floor of patches: how its centre, load and spread change."""

    def __init__(self, model: SliderModel, points: tuple[Point, ...], field: FrictionField) -> None:
        cof_x, cof_y = model.cof_m
        self._points = tuple((px - cof_x, py - cof_y) for px, py in points)
        self._cof = model.cof_m
        self._reach = model.shape.bounding_radius_m
        self._spread = sum(hypot(*p) for p in self._points)
        self._field = field
        self._seen: tuple[float, float, float, float] | None = None
        self._answer = (0.0, 0.0, 1.0, 1.0)

    def __call__(self, x: float, y: float, cos_: float, sin_: float) -> tuple[float, float, float, float]:
        """Return shift of the centre of friction x, y (m, BODY), load and spread relative to an even floor."""
        if self._seen is not None:
            old_x, old_y, old_cos, old_sin = self._seen
            turned = abs(cos_ - old_cos) + abs(sin_ - old_sin)
            if abs(x - old_x) + abs(y - old_y) + turned * self._reach < LOOK_AGAIN_M:
                return self._answer
        self._seen = (x, y, cos_, sin_)
        at = self._field.at
        cof_x, cof_y = self._cof
        weights = [
            at(x + cos_ * (cof_x + px) - sin_ * (cof_y + py), y + sin_ * (cof_x + px) + cos_ * (cof_y + py))
            for px, py in self._points
        ]
        total = sum(weights)
        shift_x = sum(w * p[0] for w, p in zip(weights, self._points, strict=True)) / total
        shift_y = sum(w * p[1] for w, p in zip(weights, self._points, strict=True)) / total
        spread = sum(w * hypot(p[0] - shift_x, p[1] - shift_y) for w, p in zip(weights, self._points, strict=True))
        count = len(self._points)
        self._answer = (shift_x, shift_y, total / count, spread / total * count / self._spread)
        return self._answer


def _pressure_moment(shape: Shape, pressure: Pressure) -> Moment:
    """Return the mean of x^2, xy, y^2 of a pressure distribution about its centre (m^2)."""
    if isinstance(pressure, str) and pressure in SCALE_OF_UNIFORM:
        xx, xy, yy = shape.second_moment_m2()
        scale = SCALE_OF_UNIFORM[pressure] ** 2
        return (xx * scale, xy * scale, yy * scale)
    points = support_points(shape, pressure, MOST_POINTS)
    x0, y0 = centre_of(points)
    return (
        sum(w * (x - x0) ** 2 for x, _, w in points),
        sum(w * (x - x0) * (y - y0) for x, y, w in points),
        sum(w * (y - y0) ** 2 for _, y, w in points),
    )


def _room(shape: Shape, cof: Point) -> float:
    """Return how far the centre of friction can move in any direction before it leaves the shape (m)."""
    if isinstance(shape, Circle):
        return shape.radius_m - hypot(*cof)
    return min(f.normal_x * cof[0] + f.normal_y * cof[1] - f.offset for f in shape.faces)
