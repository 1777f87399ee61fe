"""What a person needs beside a row of the fault table: its likely causes, and what to do next."""

from __future__ import annotations

from typing import NamedTuple


class Advice(NamedTuple):
    """Likely causes, and the next step."""

    cause: str
    next_step: str
