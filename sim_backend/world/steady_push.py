"""A push that goes on as it is, advanced many steps at once: base, ball and slider together."""

from __future__ import annotations

from typing import Any

from sim_backend.physics.contact_outcome import ContactOutcome
from sim_backend.physics.steady import kernel
from sim_backend.physics.steady.slider import SteadySlider
from sim_backend.world.base_plant import GRID_NS, BasePlant


class SteadyPush:
    """Goes on with a push of `slider` by a ball at `reach` (m, BODY frame) on a base.

    compiled: by numba, where it is installed. That costs a second once, and changes no bit of what comes.
    """

    def __init__(
        self, plant: BasePlant, slider: SteadySlider, reach: tuple[float, float], *, compiled: bool = False
    ) -> None:
        self._plant, self._slider, self._reach = plant, slider, reach
        machine = kernel.compiled() if compiled else None
        self._run: kernel.Kernel = machine or kernel.plain
        self._arrays = machine is not None
        self._given: Any = None
        self._given_for: object = None

    def advance(self, steps: int, ball: tuple[float, float]) -> tuple[int, tuple[float, float], ContactOutcome] | None:
        """Advance by at most `steps` (at least 1, of 1 ms) and return how many these were, the ball and the contact.

        ball: its centre now, m, WORLD. Returns None where the next step is none of a push that goes on as it is.
        """
        slider, plant = self._slider, self._plant
        if not slider.goes_on_from(ball):
            return None
        plant.leave()
        steps = min(steps, plant.steps_at_this_velocity)
        key = (plant.velocity, slider.face)
        if key != self._given_for:
            self._given_for, self._given = key, self._given_now()
        state: Any = [*plant.place, *ball, *slider.state, *_NO_OUTCOME]
        if self._arrays:
            import numpy as np

            array = np.array(state)
            done = self._run(self._given, array, steps)
            state = array.tolist()
        else:
            done = self._run(self._given, state, steps)
        if not done:
            return None
        plant.roll_to((state[0], state[1], state[2]), done)
        ball = (state[3], state[4])
        return done, ball, slider.continue_at(ball, state[5:])

    def _given_now(self) -> Any:
        velocity = self._plant.velocity
        motion = (velocity.vx, velocity.vy, velocity.omega, GRID_NS * 1e-9, self._plant.grip, *self._reach)
        given = [*motion, *self._slider.given()]
        if self._arrays:
            import numpy as np

            return np.array(given)
        return given


_NO_OUTCOME = (0.0,) * 7
