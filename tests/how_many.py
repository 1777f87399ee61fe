"""How much of a long proof is run: a share of it, or all of it where the environment says PUSH_TEST_FULL=1."""

from __future__ import annotations

import os


def how_many(usual: int, full: int) -> int:
    """Return `full` where everything is asked for, otherwise `usual`."""
    return full if os.environ.get("PUSH_TEST_FULL") == "1" else usual
