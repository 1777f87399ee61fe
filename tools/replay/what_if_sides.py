"""One side of a what-if: ticks run with one rig's settings, and what differs from the other side."""

from __future__ import annotations

import math
from typing import Any

import msgspec
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import Mode, TickInput, TickOutput, TickState
from safety.faults import FAULTS, limit_of
from tools.run.tick_core import TickCore
from tools.verdict.first_cause import fault_words

PARTS = ("wanted", "command", "mode", "faults", "end")
"""What is compared of an output: the law's velocity, that after the envelope, and the supervisor's verdict."""


class Change(msgspec.Struct, frozen=True):
    """One tick in which a part differs; at_s counts from the log's first tick. Velocities: m/s, rad/s, BODY frame."""

    tick: int
    at_s: float
    log: Any
    what_if: Any


class PartResult(msgspec.Struct, frozen=True):
    """In how many ticks a part differs, and first where."""

    ticks: int
    first: Change | None
    worst_m_per_s: float
    """Largest difference of two velocities; 0 for the other parts."""
    worst_tick: int
    """-1 if there is none."""


class OtherFault(msgspec.Struct, frozen=True):
    """A fault that only one side has, and what was measured in its first tick; None where nothing is."""

    id: str
    tick: int
    at_s: float
    value: float | None
    limit: float | None
    unit: str
    text: str


class End(msgspec.Struct, frozen=True):
    """The tick in which a run ends by itself."""

    tick: int
    at_s: float
    exit_code: int


class Part:
    """Counts the ticks in which one part of the outputs differs."""

    def __init__(self) -> None:
        self._ticks = 0
        self._first: Change | None = None
        self._worst, self._worst_tick = 0.0, -1

    def take(self, change: Change) -> None:
        """Count a tick."""
        self._ticks += 1
        self._first = self._first or change
        if isinstance(change.log, BodyTwist):
            off = math.hypot(change.log.vx - change.what_if.vx, change.log.vy - change.what_if.vy)
            if off > self._worst:
                self._worst, self._worst_tick = off, change.tick

    def result(self) -> PartResult:
        """Return the counts."""
        return PartResult(self._ticks, self._first, self._worst, self._worst_tick)


class Side:
    """The ticks with one rig's settings: the state that is carried on, the faults so far, and the end."""

    def __init__(self, core: TickCore) -> None:
        self._core = core
        self._faults: dict[str, tuple[int, float, float]] = {}
        self.state = TickState()
        self.end: End | None = None

    def run(self, inp: TickInput, at_s: float) -> TickOutput:
        """Run one tick and return its output."""
        try:
            self.state, output = self._core.fold(self.state, inp)
        except Exception:  # as in a run: a tick that fails ends it (F68)
            failed = replace(inp, host=replace(inp.host, loop_error=True))
            self.state, output = self._core.fold(self.state, failed)
        for fault, value in zip(output.faults, output.fault_values, strict=True):
            self._faults.setdefault(fault, (inp.tick, at_s, value))
        if output.finished and self.end is None:
            self.end = End(inp.tick, at_s, output.exit_code)
        return output

    def remembers_the_same(self, other: Side) -> bool:
        """Return whether both have the same state, NaN included."""
        return msgspec.msgpack.encode(self.state) == msgspec.msgpack.encode(other.state)

    def faults_not_in(self, other: Side) -> tuple[OtherFault, ...]:
        """Return the faults that the other side does not have, in the order in which they came."""
        found = []
        for fault, (tick, at_s, value) in self._faults.items():
            if fault not in other._faults:
                row, known = FAULTS[fault], value if math.isfinite(value) else None
                limit = limit_of(row, self._core.safety)
                text = fault_words(fault, known, limit, row.unit)
                found.append(OtherFault(fault, tick, at_s, known, limit, row.unit, text))
        return tuple(found)


def parts_of(output: TickOutput) -> dict[str, Any]:
    """Return the parts of an output by their names in PARTS."""
    return {
        "wanted": output.wanted_body,
        "command": output.command_body,
        "mode": Mode(output.mode).name,
        "faults": output.faults,
        "end": output.exit_code if output.finished else None,
    }
