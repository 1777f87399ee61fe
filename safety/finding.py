"""What a check finds: a row of the fault table, and what was measured."""

from __future__ import annotations

import math

NS_PER_MS = 1e6
"""Ages are measured in ns and told in ms."""


class Finding(str):
    """The id of a row, with the measured `value` in the row's unit (NaN where nothing is measured).

    It is the id itself, so that the rules of the supervisor, which look at ids only, need not know of values.
    """

    __slots__ = ("value",)
    value: float

    def __new__(cls, fault: str, value: float = math.nan) -> Finding:
        """Return the finding of a row."""
        finding = super().__new__(cls, fault)
        finding.value = value
        return finding


def value_of(fault: str) -> float:
    """Return the measured value of a finding, NaN for a bare id."""
    return fault.value if isinstance(fault, Finding) else math.nan
