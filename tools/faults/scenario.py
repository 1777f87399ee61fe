"""How a row of the fault table is brought about: faults at the devices' edges, or facts of the host."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

import msgspec

from robot_io.tick import TickInput, TickState
from safety.gate_shell import GateShell
from tools.run.tick_core import TickCore

Alter = Callable[[TickInput, TickState, int], TickInput]
"""(input, state before, ticks since the moment) -> the input that the core sees."""


class Moment(StrEnum):
    """When a fault begins: as a word stands in braces in the scenario's words."""

    START = "start"
    """The first tick."""
    APPROACH = "approach"
    """Half a second into the approach at full speed."""
    PUSH = "push"
    """Half a second into the push at full speed."""
    RETREAT = "retreat"
    """The first tick of the retreat."""
    END = "end"
    """The first tick at rest after the push."""


class Scenario(msgspec.Struct, frozen=True):
    """One way to bring about `row`. `words` are faults to inject, without their times."""

    row: str
    what: str
    words: tuple[str, ...] = ()
    moment: Moment = Moment.PUSH
    alter: Alter | None = None
    core: Callable[[TickCore], TickCore] | None = None
    """Puts a defect into control from the moment on."""
    silent: bool = False
    """Control sends no frame to the gate from the moment on."""
    dead: bool = False
    """Control is gone from the moment on."""
    gate: Callable[[GateShell], GateShell] | None = None
    """Changes the gate at the moment."""
    settings: tuple[str, ...] = ()
    """Of the rig."""
    edge_beside_m: float | None = None
    """The workspace ends this far to the left of the base's outline at the moment."""
    begins: Callable[[TickInput, TickState], bool] | None = None
    """Where the row waits for evidence by design (a distance): whether there is enough of it."""
    evidence_ticks: int = 0
    """Where the row waits for evidence by design (a time): how long."""
    standing: bool = False
    """The base stands then, so that no command is to be reduced."""

    @property
    def by_gate(self) -> bool:
        """Return whether the gate acts, not control: what it sends is measured."""
        return self.silent or self.dead or self.gate is not None


def at(words: tuple[str, ...], moment_s: float) -> tuple[str, ...]:
    """Return the words with their time; a word may end in ` for T s`, which stays behind it."""
    timed = []
    for word in words:
        name, _, span = word.partition(" for ")
        timed.append(f"{name} at {moment_s:.2f} s" + (f" for {span}" if span else ""))
    return tuple(timed)
