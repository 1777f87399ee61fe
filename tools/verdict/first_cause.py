"""The first cause of a stop: which row of the fault table, what was measured, its limit, and when."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from robot_io.rig.config import RigConfig
from robot_io.tick import Mode
from safety.faults import FAULTS, limit_of
from safety.gate import LATCH_FAULT, Latch
from safety.settings import SafetySettings

GATE_LATCHED = "F67"
EMULATORS = "emulators"
OUTSIDE = {EMULATORS: "the emulators have ended, and with them every emulated device"}
"""Causes that are no rows of the table: control sees only what follows from them."""
FOLLOWS_WITHIN_S = 0.5
"""The launcher may learn of a death this much later than control sees a device fall silent."""


class FirstFault(msgspec.Struct, frozen=True):
    """The fault that came first and still explains why the run stopped.

    value and limit are in `unit`, None where nothing is measured or the limit depends on the moment; at_s is counted
    from the first tick.
    """

    id: str
    value: float | None
    limit: float | None
    unit: str
    at_s: float | None

    def words(self) -> str:
        """Return the cause in words: row, text, number, time and limit."""
        at = "" if self.at_s is None else f" at {self.at_s:.1f} s"
        return fault_words(self.id, self.value, self.limit, self.unit, at)


def first_fault(rig: RigConfig, figures: dict[str, Any]) -> FirstFault | None:
    """Return the first cause named in a run's figures, None where nothing stopped it.

    Where control only saw that the gate had latched, the gate's own reason is the cause.
    """
    fault, value = figures["first_fault"], figures["first_value"]
    if not fault:
        return None
    if fault == GATE_LATCHED:
        fault = LATCH_FAULT.get(Latch(figures["latch_cause"]), fault)
    limit, unit = limit_and_unit(rig, fault)
    at_s = figures["first_fault_s"]
    return FirstFault(fault, value, limit, unit, None if at_s is None else round(at_s, 3))


def with_dead_emulators(figures: dict[str, Any], died_ns: int) -> dict[str, Any]:
    """Return a run's figures with the death of its emulators as first cause, if what stopped the run came with it.

    died_ns: when it was noticed (CLOCK_MONOTONIC), 0 if the emulators lived to the end of the run.
    """
    first_s, died_s = figures["first_fault_s"], (died_ns - figures["first_tick_ns"]) * 1e-9
    if not died_ns or not figures["exit_code"] or first_s is None or first_s < died_s - FOLLOWS_WITHIN_S:
        return figures
    return figures | {"first_fault": EMULATORS, "first_value": None, "first_fault_s": min(first_s, died_s)}


def limit_and_unit(rig: RigConfig, fault: str) -> tuple[float | None, str]:
    """Return the limit of a row with the settings of a rig (None: it has none), and the row's unit."""
    row = FAULTS.get(fault)
    if row is None:
        return None, ""
    return limit_of(row, SafetySettings.of(rig)), row.unit


def fault_words(fault: str, value: float | None, limit: float | None, unit: str, at: str = "") -> str:
    """Return a fault in words: "F50-stop the force is above the limit: 163 N, limit 150 N".

    at: said behind the number.
    """
    text = f"{fault} {FAULTS[fault].text}" if fault in FAULTS else OUTSIDE.get(fault, fault)
    if value is None or not math.isfinite(value):
        return f"{text}{at}"
    measured, allowed = _beside(value, limit)
    unit = f" {unit}" if unit else ""
    return f"{text}: {measured}{unit}{at}" + (f", limit {allowed}{unit}" if allowed else "")


def stronger_than(first: str, faults: list[str]) -> list[str]:
    """Return the faults that asked for more than the first cause did; all others of a run are its consequences."""
    mode = FAULTS[first].mode if first in FAULTS else Mode.SILENT
    return [i for i in faults if i in FAULTS and FAULTS[i].mode > mode]


def _beside(value: float, limit: float | None) -> tuple[str, str]:
    """Return both as text, with as many digits as it takes to tell them apart, three at least."""
    if limit is None:
        return _digits(value, 3), ""
    for digits in range(3, 7):
        measured, allowed = _digits(value, digits), _digits(limit, digits)
        if measured != allowed:
            break
    return measured, allowed


def _digits(value: float, digits: int) -> str:
    whole = len(str(int(abs(value))))
    return f"{value:.{max(digits, whole)}g}"
