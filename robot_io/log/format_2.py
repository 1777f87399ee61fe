"""What logs up to format 2 say where a tick of today may say nothing. Frozen: those logs do not change any more."""

from __future__ import annotations

from typing import Any

from robot_io.tick import Phase


def always(_message: Any) -> bool:
    """Return True: what they held in every message."""
    return True


def sums_count(control: Any) -> bool:
    """Return whether the sums in a state of control were of its phase; they were kept until the next ones began."""
    return (
        control.phase in (Phase.TARE, Phase.CHECK)
        and control.tare.count > 0
        and control.last_reading_ns > control.phase_since_ns
    )
