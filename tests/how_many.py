"""How much of a long proof is run: some cases or all of them, a share or everything where PUSH_TEST_FULL=1."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import pytest


def how_many(usual: int, full: int) -> int:
    """Return `full` where everything is asked for, otherwise `usual`."""
    return full if os.environ.get("PUSH_TEST_FULL") == "1" else usual


def mostly_long(cases: Iterable[Any], *always: Any) -> list[Any]:
    """Return the cases for `parametrize`: only those of `always` are in `make test`, too."""
    every = list(cases)
    assert all(case in every for case in always), "a case of that name is gone"
    return [case if case in always else pytest.param(case, marks=pytest.mark.long) for case in every]
