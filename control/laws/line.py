"""The baseline that follows the line and does not feel: the ball itself is led back to the path."""

from __future__ import annotations

from typing import ClassVar

from control.laws.law import NoSettings, NoState, Seen
from robot_io.rig.config import ControlConfig


class Line:
    """theta_p = -k_y y_c: left of the path the ball goes to the right, whatever the object does."""

    name: ClassVar[str] = "line"
    Settings: ClassVar = NoSettings
    State: ClassVar = NoState

    def __init__(self, control: ControlConfig, settings: NoSettings) -> None:
        self._k_y = control.k_y_rad_per_m

    def initial(self) -> NoState:
        """Return the empty state."""
        return NoState()

    def step(self, state: NoState, seen: Seen) -> tuple[float, NoState]:
        """Return theta_p in rad."""
        return -self._k_y * seen.lateral_m, state
