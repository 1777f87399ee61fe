"""The verdict of a run: `done` only where no evidence speaks against it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from robot_io.errors import NotDone
from tools.verdict.evidence import LINE, TrustItem

DONE, OFF_THE_LINE, NOT_TRUSTED, CONTACT_LOST = "done", "off the line", "not trusted", "contact lost"
FAILURES = {
    1: "error",
    2: "refused",
    4: "not ready",
    5: "safety stop",
    6: CONTACT_LOST,
    130: "operator stop",
}


class Judgement(NamedTuple):
    """A verdict and its exit code."""

    verdict: str
    exit_code: int


def judge(exit_code: int, trust: Sequence[TrustItem]) -> Judgement:
    """Return the verdict on a run that ended with `exit_code`; a failure stays what it is, whatever the evidence.

    Where a run cannot be trusted, neither can its place on the line: that verdict is the stronger one.
    """
    if exit_code:
        return Judgement(FAILURES.get(exit_code, "error"), exit_code)
    against = {item.id for item in trust if item.says == "against"}
    if against - set(LINE):
        return Judgement(NOT_TRUSTED, NotDone.exit_code)
    if against:
        return Judgement(OFF_THE_LINE, NotDone.exit_code)
    return Judgement(DONE, 0)
