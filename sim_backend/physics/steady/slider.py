"""A pushed slider that hands over to the steady kernel, and goes on from where that ended."""

from __future__ import annotations

from collections.abc import Sequence

from sim_backend.physics.contact import REST_M_PER_S, PushedSlider
from sim_backend.physics.contact_outcome import ContactMode, ContactOutcome
from sim_backend.physics.floor import Floor
from sim_backend.physics.slider import SliderModel

_MODES = (ContactMode.STICKING, ContactMode.SLIDING_LEFT, ContactMode.SLIDING_RIGHT)


class SteadySlider(PushedSlider):
    """A `PushedSlider` solved in closed form on a floor that resists along the push, with what the kernel needs of it.

    Raises ConfigError as that does, and ValueError for a floor whose `steady` is None.
    """

    def __init__(
        self, model: SliderModel, pose: tuple[float, float, float], ball_radius_m: float, floor: Floor
    ) -> None:
        super().__init__(model, pose, ball_radius_m, floor=floor)
        if floor.steady is None:
            raise ValueError("the kernel does not know this floor")
        self._resistance = floor.steady

    @property
    def face(self) -> int:
        """The face that the ball pushes (0 on a disc), -1 for a corner; meaningful only in contact."""
        return self._face

    @property
    def state(self) -> tuple[float, ...]:
        """Pose, contact and push as the kernel has them, from `x` on."""
        place = (self.x_m, self.y_m, self.heading_rad, self._cos, self._sin)
        return (*place, self._nx, self._ny, self._cx, self._cy, self._push_x, self._push_y)

    def goes_on_from(self, ball: tuple[float, float]) -> bool:
        """Return whether a ball here (m, WORLD) may go on pushing as the kernel has it."""
        return self._touching and not self._new and self._face >= 0 and ball == self._ball

    def given(self) -> tuple[float, ...]:
        """Return what the kernel takes as given, from `radius` on."""
        face = self._outline.rows[self._face][:5] if self._outline.rows else (0.0,) * 5
        ball = (self._radius, self._piece_m, REST_M_PER_S)
        floor = (*self._resistance, *self.model.cof_m, self._f_max, self._mu)
        return (*ball, *floor, self._outline.radius_m, *face)

    def continue_at(self, ball: tuple[float, float], state: Sequence[float]) -> ContactOutcome:
        """Accept what the kernel found, from `x` on, with the ball where it brought it; return the contact there."""
        self.x_m, self.y_m, self.heading_rad, self._cos, self._sin = state[:5]
        self._nx, self._ny, self._cx, self._cy, self._push_x, self._push_y = state[5:11]
        self._ball = ball
        self._outcome = ContactOutcome(_MODES[int(state[17])], *state[11:17])
        return self._outcome
