"""The baseline of the paper's experiment: straight along the path, regardless of the force."""

from __future__ import annotations

from typing import ClassVar

from control.laws.law import NoSettings, NoState, Seen
from robot_io.rig.config import ControlConfig


class OpenLoop:
    """theta_p = 0. Without contact it searches straight ahead, too."""

    name: ClassVar[str] = "open loop"
    Settings: ClassVar = NoSettings
    State: ClassVar = NoState
    returns_to_path: ClassVar[bool] = False

    def __init__(self, control: ControlConfig, settings: NoSettings) -> None:
        pass

    def initial(self) -> NoState:
        """Return the empty state."""
        return NoState()

    def step(self, state: NoState, seen: Seen) -> tuple[float, NoState]:
        """Return theta_p = 0: along the path."""
        return 0.0, state
