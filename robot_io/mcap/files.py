"""The files of a log: one, or parts that are numbered from 1 on, each of them whole by itself.

The name of the whole stands for its parts: `run.mcap`, where there is no such file, for `run_001.mcap`, `run_002.mcap`,
and so on.
"""

from __future__ import annotations

import re
from pathlib import Path

from robot_io.errors import LogDamaged

_NUMBER = re.compile(r"_([0-9]{3,6})$")


def part_path(log: Path, number: int) -> Path:
    """Return the file of a part, numbered from 1 on."""
    return log.with_name(f"{log.stem}_{number:03d}{log.suffix}")


def whole_of(file: Path) -> Path:
    """Return the name of the whole that a file is a part of by its name; the file itself where it is none."""
    found = _NUMBER.search(file.stem)
    return file.with_name(f"{file.stem[: found.start()]}{file.suffix}") if found else file


def has_parts(log: Path) -> bool:
    """Return whether a name stands for parts. Raises OSError if the folder cannot be read."""
    return not log.exists() and bool(_parts(log))


def files_of(log: Path) -> tuple[Path, ...]:
    """Return the files of a log in their order: itself, or its parts. Raises LogDamaged where one is missing."""
    parts = {} if log.exists() else _parts(log)
    if not parts:
        return (log,)
    for number in range(1, max(parts) + 1):
        if number not in parts:
            name = part_path(log, number).name
            raise LogDamaged(f"part {number} of the log is missing", where=str(log.parent), do=f"Look for {name}")
    return tuple(parts[number] for number in sorted(parts))


def _parts(log: Path) -> dict[int, Path]:
    found = {}
    for file in log.parent.glob(f"*{log.suffix}") if log.parent.is_dir() else ():
        number = _NUMBER.search(file.stem)
        if number and whole_of(file) == log:
            found[int(number.group(1))] = file
    return found
