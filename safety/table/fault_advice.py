"""Causes and next steps of every row of the fault table."""

from __future__ import annotations

from safety.table.advice import Advice
from safety.table.device_advice import DEVICE_ADVICE
from safety.table.task_advice import TASK_ADVICE

ADVICE = {**DEVICE_ADVICE, **TASK_ADVICE}
"""By row, or by family: `F01` is for `F01-slow`, `F01-hold` and `F01-stop`, if they have none of their own."""

NONE = Advice("", "")


def advice_of(row: str) -> Advice:
    """Return the advice for a row: its own, or its family's; empty if there is none."""
    return ADVICE.get(row) or ADVICE.get(row.partition("-")[0], NONE)
