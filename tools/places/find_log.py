"""Find the log that a user names."""

from __future__ import annotations

from pathlib import Path

from robot_io.errors import UsageError
from robot_io.mcap.files import has_parts


def find_log(named: Path) -> Path:
    """Return `named`, or the run.mcap in it if it is a run's folder; that name also stands for a log in parts.

    Raises UsageError if the folder has none or cannot be read.
    """
    log = named / "run.mcap"
    try:
        if not named.is_dir():
            return named
        there = log.exists() or has_parts(log)
    except OSError as error:
        raise UsageError(f"this cannot be read: {error.strerror}", where=str(named)) from None
    if not there:
        raise UsageError("there is no run.mcap in this folder", where=str(named), do="Name the log itself")
    return log
