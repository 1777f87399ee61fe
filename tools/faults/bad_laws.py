"""Laws with a defect, to bring about the rows of the fault table that are about laws."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from msgspec.structs import replace

from control.laws.applied import AppliedLaw
from control.laws.law import NoSettings, NoState, Seen
from tools.run.tick_core import TickCore


class BadLaw:
    """A law that gives no number."""

    name = "bad"
    Settings = NoSettings
    State = NoState

    def initial(self) -> Any:
        """Return the empty state."""
        return NoState()

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Return an angle that is not a number."""
        return math.nan, state


class Infinite(BadLaw):
    """A law whose angle is infinite."""

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Return an infinite angle."""
        return math.inf, state


class Raising(BadLaw):
    """A law that raises an exception."""

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Divide by zero."""
        return 1.0 / (seen.dt_s - seen.dt_s), state


class Forgetful(BadLaw):
    """A law that returns another state than it says."""

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Return a state of another type."""
        return 0.0, None


def steered_by(law: BadLaw) -> Callable[[TickCore], TickCore]:
    """Return what gives a core another law."""
    return lambda core: replace(core, control=replace(core.control, law=AppliedLaw(law)))
