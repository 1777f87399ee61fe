"""The form of a law. A law of your own needs nothing of this file: a class with these parts is a law (docs/own-law.md).

A law is called once a tick while the base pushes and the contact is felt: not while the contact is lost, not while the
base is held. Its state is kept through both.
"""

from __future__ import annotations

from typing import Any, Protocol

import msgspec


class Seen(msgspec.Struct, frozen=True, gc=False):
    """All that a law sees. PATH frame: x along the direction of travel, y to the left."""

    force_along_N: float
    force_across_N: float
    """Filtered force on the object, N."""
    force_valid: bool
    """Whether that force is felt now; it is whenever a law is called."""
    theta_f_rad: float
    """Angle of that force, in (-pi, pi]."""
    lateral_m: float
    """How far the ball's centre is to the left of the path."""
    progress_m: float
    """How far it has come along the path since the first contact."""
    speed_m_per_s: float
    """Measured speed of the base, 0 where it is not known."""
    dt_s: float
    """Time since the tick before."""


class NoSettings(msgspec.Struct, frozen=True):
    """The settings of a law that adds none."""


class NoState(msgspec.Struct, frozen=True):
    """The state of a law that remembers nothing."""


class Law(Protocol):
    """What a law has. It is pure: the same state and the same `seen` give the same result, bit for bit.

    A class is built with the rig's `[control]` (msgspec Struct with `k_f`, `k_y_rad_per_m`, ...) and its own Settings.
    """

    @property
    def name(self) -> str:
        """What it is called in reports."""
        ...

    @property
    def Settings(self) -> type[msgspec.Struct]:  # noqa: N802  (a class)
        """What `[control.law_settings]` may hold: frozen, all with defaults."""
        ...

    @property
    def State(self) -> type[msgspec.Struct]:  # noqa: N802  (a class)
        """What it remembers: frozen; float, int, bool and tuples of a fixed number of them."""
        ...

    def initial(self) -> Any:
        """Return the state before the first step."""
        ...

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Return the direction of the push, theta_p in rad (PATH frame, left positive), and the state after it."""
        ...
