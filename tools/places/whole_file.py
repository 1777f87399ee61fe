"""Writes files that are there whole or not at all, whoever reads meanwhile and whatever fails."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> None:
    """Write a file, replacing what has its name. Raises OSError, and then leaves nothing behind."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def check_writable(folder: Path) -> None:
    """Raise OSError unless files can be made in a folder: better now than when a run is over."""
    probe = folder / ".writable"
    probe.touch()
    probe.unlink()
