"""What is wrong with a file that is to be read as a log, in words."""

from __future__ import annotations

from pathlib import Path

from robot_io.errors import LogDamaged

RECORD_LIMIT = 64 << 20
"""Largest record, and largest chunk after decompression, in bytes. Ours are about 1 MiB."""


def truncated(path: Path) -> LogDamaged:
    """Return the error for a file that ends too soon."""
    return LogDamaged(
        "the log is truncated (its recorder was killed, the disk was full, or the run is still going on)",
        where=str(path),
        do=f"When the run is over, `push log recover {path}` repairs what is there",
    )


def altered(path: Path, why: str) -> LogDamaged:
    """Return the error for a file that is not as it was written."""
    return LogDamaged(
        f"the log is damaged: {why}",
        where=str(path),
        do=f"Take another copy of it; `push log recover {path}` keeps what comes before the damage",
    )


def beyond(path: Path, why: str) -> LogDamaged:
    """Return the error for a file that may be sound, but holds what this program does not read."""
    return LogDamaged(f"this log cannot be read here: {why}", where=str(path), do="Read it with the tool that wrote it")


def too_large(path: Path, what: str, size_bytes: int) -> LogDamaged:
    """Return the error for a part of a file of others that is larger than what is read into memory."""
    return beyond(path, f"{what} has {size_bytes} bytes, and at most {RECORD_LIMIT} are read into memory")
