"""Where the log is that a user names."""

from __future__ import annotations

from pathlib import Path

from robot_io.errors import UsageError


def find_log(named: Path) -> Path:
    """Return `named`, or the run.mcap in it when it is a run's folder. Raises UsageError when that has none."""
    if not named.is_dir():
        return named
    log = named / "run.mcap"
    if not log.exists():
        raise UsageError("there is no run.mcap in this folder", where=str(named), do="Name the log itself")
    return log
