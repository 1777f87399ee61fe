"""Write files atomically: readers see the complete file or none, whatever fails."""

from __future__ import annotations

import json
import os
from pathlib import Path


def write_atomically(path: Path, content: bytes, *, mode: int = 0o644) -> None:
    """Write a file, replacing any existing one. Raises OSError, and then leaves nothing behind.

    mode: the file's permissions, less those that the umask takes away.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.touch(mode)
        part.write_bytes(content)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def write_new(path: Path, content: bytes) -> None:
    """Write a file where there is none. Raises FileExistsError and OSError, and then leaves nothing behind."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        path.hardlink_to(part)  # unlike a rename, this never replaces another file
    finally:
        part.unlink(missing_ok=True)


def write_json(path: Path, value: object) -> None:
    """Write a JSON file for people and programs. Raises OSError, or ValueError for a number that is not finite."""
    write_atomically(path, (json.dumps(value, indent=2, allow_nan=False) + "\n").encode())


def check_writable(folder: Path) -> None:
    """Raise OSError unless files can be created in a folder: better now than at the end of a run."""
    probe = folder / ".writable"
    try:
        probe.touch()
    finally:
        probe.unlink(missing_ok=True)
