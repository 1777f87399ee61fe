"""The paper's law."""

from __future__ import annotations

from typing import ClassVar

from control import push_law
from control.laws.law import NoSettings, NoState, Seen
from robot_io.rig.config import ControlConfig


class ForceFeedback:
    """theta_p = (k_f + 1) theta_f + k_y y_c; see `control.push_law`."""

    name: ClassVar[str] = "force feedback"
    Settings: ClassVar = NoSettings
    State: ClassVar = NoState

    def __init__(self, control: ControlConfig, settings: NoSettings) -> None:
        self._k_f, self._k_y = control.k_f, control.k_y_rad_per_m

    def initial(self) -> NoState:
        """Return the empty state."""
        return NoState()

    def step(self, state: NoState, seen: Seen) -> tuple[float, NoState]:
        """Return theta_p in rad."""
        return push_law.push_angle(seen.theta_f_rad, seen.lateral_m, self._k_f, self._k_y), state
