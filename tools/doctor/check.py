"""One row for each check of `push doctor`, and the report made of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import msgspec
from msgspec.structs import asdict

from robot_io.errors import PushError

Result = Literal["ok", "warning", "failed", "skipped"]
RESULTS: tuple[Result, ...] = ("ok", "warning", "failed", "skipped")
SCHEMA = 1

FT = ("port", "permission", "lock", "latency-timer", "identity", "rate", "crc", "noise", "bias", "echo")
ARM = ("ports", "version", "mode", "safety", "pose", "turns", "inputs")
BASE = (
    "handshake", "round-trip", "command-type", "command-listener", "other-publisher", "pose", "odometry", "status",
    "clock", "frame", "e-stop", "battery",
)  # fmt: skip
HOST = ("scheduling", "limits", "disk", "memory", "suspend", "clock")
RIG = ("workspace", "corridor", "stopping-distance", "gains", "calibration-age")
NAMES = {"ft": FT, "arm": ARM, "base": BASE, "host": HOST, "rig": RIG}
"""Every check, by what it looks at, in the order in which it is told."""
WIDTH = max(len(f"{of}.{name}") for of, names in NAMES.items() for name in names)


class Check(msgspec.Struct, frozen=True):
    """One check: what was found, and what to do about it. `value` and `limit` are in `unit`."""

    check: str
    result: Result
    value: float | str | None = None
    limit: float | None = None
    unit: str = ""
    evidence: str = ""
    fix: str = ""
    where: str = ""
    """What the evidence is of, where the row's name does not say it; told in front of it."""

    @property
    def told(self) -> str:
        """The evidence, and what it is of."""
        return f"{self.where}: {self.evidence}" if self.where else self.evidence


class Rows:
    """The rows of one device while they are found, by their short names; those never found are skipped."""

    def __init__(self, of: str) -> None:
        self._of = of
        self._found: dict[str, Check] = {}

    @property
    def found(self) -> frozenset[str]:
        """The short names of the rows found so far."""
        return frozenset(self._found)

    def ok(
        self, name: str, evidence: str, value: float | str | None = None, limit: float | None = None, unit: str = ""
    ) -> None:
        """Note that all is well."""
        self._note(Check(f"{self._of}.{name}", "ok", _finite(value), limit, unit, evidence))

    def bad(
        self,
        name: str,
        result: Result,
        evidence: str,
        fix: str,
        value: float | str | None = None,
        limit: float | None = None,
        unit: str = "",
    ) -> None:
        """Note a warning or a failure, and what to do."""
        self._note(Check(f"{self._of}.{name}", result, _finite(value), limit, unit, evidence, fix))

    def error(self, name: str, error: PushError) -> None:
        """Note a failure as an error says it."""
        self._note(Check(f"{self._of}.{name}", "failed", evidence=error.what, fix=error.do, where=error.where))

    def skip(self, name: str, why: str) -> None:
        """Note that a check was not made."""
        self._note(Check(f"{self._of}.{name}", "skipped", evidence=why))

    def all(self, why: str) -> list[Check]:
        """Return one row for each check, in order; `why` those not found are skipped."""
        return [
            self._found.get(name) or Check(f"{self._of}.{name}", "skipped", evidence=why) for name in NAMES[self._of]
        ]

    def of(self, name: str) -> Check:
        """Return one row that was found."""
        return self._found[name]

    def _note(self, check: Check) -> None:
        self._found[check.check.partition(".")[2]] = check


def report(rig_name: str, checks: Sequence[Check]) -> dict[str, Any]:
    """Return the report as `push doctor --json` prints it."""
    counts = {result: sum(check.result == result for check in checks) for result in RESULTS}
    return {
        "schema": SCHEMA,
        "rig": rig_name,
        "ok": counts["failed"] == 0,
        "counts": counts,
        "checks": [_row(check) for check in checks],
    }


def lines(checks: Iterable[Check]) -> list[str]:
    """Return the rows for people: aligned, with the fix below each that needs one."""
    told, width = [], WIDTH
    for check in checks:
        told.append(f"{check.result:<8} {check.check:<{width}}  {check.told}".rstrip())
        if check.fix:
            told.append(f"{'':<8} {'':<{width}}  -> {check.fix}")
    return told


def summary_line(checks: Sequence[Check]) -> str:
    """Return how many checks ended how."""
    counts = {result: sum(check.result == result for check in checks) for result in RESULTS}
    words = {**{result: result for result in RESULTS}, "warning": "warning" if counts["warning"] == 1 else "warnings"}
    return ", ".join(f"{count} {words[result]}" for result, count in counts.items() if count)


def _row(check: Check) -> dict[str, Any]:
    row = asdict(check)
    del row["where"]
    return row | {"evidence": check.told}


def _finite(value: float | str | None) -> float | str | None:
    return None if isinstance(value, float) and not math.isfinite(value) else value
