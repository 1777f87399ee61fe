"""Writes files that are there whole or not at all, whoever reads meanwhile and whatever fails."""

from __future__ import annotations

import json
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


def write_json(path: Path, value: object) -> None:
    """Write a JSON file for people and programs. Raises OSError, and ValueError for a number that is not finite."""
    write_whole(path, (json.dumps(value, indent=2, allow_nan=False) + "\n").encode())


def check_writable(folder: Path) -> None:
    """Raise OSError unless files can be made in a folder: better now than when a run is over."""
    probe = folder / ".writable"
    probe.touch()
    probe.unlink()
