"""A law as a tick calls it: its state as numbers, and whatever it does wrong as words. Pure if the law is."""

from __future__ import annotations

from typing import Any

import msgspec

from control.laws.law import Law, Seen
from control.laws.state_fields import StateFields

LONGEST = 200
"""Characters of an error that are kept."""


class LawResult(msgspec.Struct, frozen=True, gc=False):
    """The direction of the push (rad, PATH frame) and the state after it; with an `error` neither means anything."""

    theta_p_rad: float
    state: tuple[float, ...]
    error: str = ""


class AppliedLaw:
    """A law that never raises. Raises TypeError when its State cannot be kept, and whatever its `initial` raises."""

    def __init__(self, law: Law) -> None:
        self._kind = type(law)
        self._step = law.step
        self._fields = StateFields(law.State)
        self.initial = self._fields.pack(law.initial())
        """The state before the first step, as numbers."""
        self.names = self._fields.names
        """The name of each number of the state."""
        self.returns_to_path: bool = getattr(law, "returns_to_path", True)
        """Whether the ball turns back over the path while the contact is lost."""

    def __eq__(self, other: object) -> bool:
        """Return whether both are of one class; what they were built with is in the settings of control."""
        return isinstance(other, AppliedLaw) and other._kind is self._kind

    def __hash__(self) -> int:
        raise TypeError("it is compared, never looked up")

    def step(self, packed: tuple[float, ...], seen: Seen) -> LawResult:
        """Return what the law says; `packed` is the state, empty before the first step."""
        try:
            state = self._fields.unpack(packed or self.initial)
            returned = self._step(state, seen)
            if not isinstance(returned, tuple) or len(returned) != 2:
                raise TypeError(f"it returned a {type(returned).__name__}, not theta_p and a state")
            return LawResult(_angle(returned[0]), self._fields.pack(returned[1]))
        except Exception as error:  # somebody else's code may raise anything
            return LawResult(0.0, packed, _words(error))


def _angle(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, float | int):
        raise TypeError(f"its theta_p is a {type(value).__name__}, not a number")
    return float(value)


def _words(error: Exception) -> str:
    """Return an error on one line, without addresses, which differ from run to run."""
    lines = str(error).splitlines()
    words = ["0x..." if "0x" in word else word for word in lines[0].split()] if lines else []
    return " ".join([f"{type(error).__name__}:", *words])[:LONGEST]
