"""The floor under a slider on support points: how a push loads them, and how well each holds where it stands."""

from __future__ import annotations

from collections.abc import Sequence

from robot_io.errors import ConfigError
from sim_backend.physics.coulomb.contact import CoulombContact
from sim_backend.physics.floor_patches import FrictionField
from sim_backend.physics.shapes import Point
from sim_backend.physics.support import SupportPoint, room_of

LOOK_AGAIN_M = 0.002
"""The floor under the points is looked up again after one of them has moved about this far."""


class CoulombFloor:
    """Keeps the loads of a `CoulombContact` up to date.

    points: where the slider stands (BODY frame). load_m: where its load's centre is. shift_m: how far the pressure's
    centre runs ahead of that along the push. field: a floor of patches, None on an even one. Raises ConfigError for a
    slider that tips over.
    """

    def __init__(
        self, points: Sequence[SupportPoint], load_m: Point, shift_m: float, field: FrictionField | None
    ) -> None:
        self.contact = CoulombContact(points)
        self.centre_m = self.contact.centre_m
        if shift_m >= room_of(points, load_m):
            raise ConfigError(
                f"a slider on these support points, whose pressure moves {shift_m:.3g} m ahead, tips over",
                where="slider",
                do="Push lower, lower the floor's friction, or spread the pressure",
            )
        self._off_x, self._off_y = load_m[0] - self.centre_m[0], load_m[1] - self.centre_m[1]
        self._shift_m, self._field = shift_m, field
        self._reach = max(abs(x) + abs(y) for x, y, _ in points)
        self._seen: tuple[float, float, float, float] | None = None
        self._friction: list[float] | None = None

    def load(self, x: float, y: float, cos_: float, sin_: float, push_x: float, push_y: float) -> None:
        """Load the points for a pose (m; cosine, sine of the heading) and the direction of the push (BODY)."""
        if self._field is not None:
            self._look(self._field, x, y, cos_, sin_)
        ahead = self._shift_m
        self.contact.load((self._off_x + ahead * push_x, self._off_y + ahead * push_y), self._friction)

    def _look(self, field: FrictionField, x: float, y: float, cos_: float, sin_: float) -> None:
        if self._seen is not None:
            old_x, old_y, old_cos, old_sin = self._seen
            turned = abs(cos_ - old_cos) + abs(sin_ - old_sin)
            if abs(x - old_x) + abs(y - old_y) + turned * self._reach < LOOK_AGAIN_M:
                return
        self._seen = (x, y, cos_, sin_)
        self._friction = [
            field.at(x + cos_ * px - sin_ * py, y + sin_ * px + cos_ * py) for px, py, _ in self.contact.points
        ]
