"""A calibration as a file that a rig can include: its text, its default name, and writing it."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from robot_io.errors import EnvironmentFault, UsageError
from robot_io.rig import files
from robot_io.rig import toml as toml_text
from robot_io.rig.calibration import Calibration
from robot_io.rig.checks import build
from robot_io.rig.config import RigConfig
from tools.places.atomic_file import write_new

FOLDER = Path("calibration")
COMPLETED_BY = "emulated"
"""The rig that lends a fragment, while it is checked, what else a rig needs."""


class Fragment(msgspec.Struct, frozen=True):
    """What was measured (`frame`, `contact`, ...), the rig keys that follow from it (dotted), and how it was measured.

    notes: sentences for people, at the top of the file.
    """

    what: str
    keys: dict[str, Any]
    calibration: Calibration
    notes: tuple[str, ...] = ()


def fragment_text(fragment: Fragment) -> str:
    """Return the file's text: the same fragment always gives the same bytes. Raises ConfigError for no rig's keys."""
    data: dict[str, Any] = {}
    for key, value in fragment.keys.items():
        toml_text.put(data, tuple(key.split(".")), msgspec.to_builtins(value))
    toml_text.put(data, ("calibration", fragment.what), msgspec.to_builtins(fragment.calibration))
    made = fragment.calibration.made
    head = (
        f"Calibration `{fragment.what}` of the rig {fragment.calibration.rig}, {made.isoformat(' ', 'minutes')}.",
        "A rig takes it by `include` (docs/rig-files.md).",
        *fragment.notes,
    )
    text = "".join(f"# {' '.join(line.split())}\n" for line in head) + toml_text.emit(data)
    _check(text, fragment.what)
    return text


def default_path(what: str, made: datetime) -> Path:
    """Return a file that does not exist, named after what was measured and the day: below the current folder."""
    stem = FOLDER / f"{what}-{made.date().isoformat()}"
    path, count = stem.with_suffix(".toml"), 2
    while path.exists():
        path, count = stem.with_name(f"{stem.name}-{count}.toml"), count + 1
    return path


def write_fragment(path: Path, fragment: Fragment) -> None:
    """Write the file and the folders around it; readers see all of it or none.

    Raises ConfigError as `fragment_text`, UsageError where there is a file already, and EnvironmentFault where it
    cannot be written.
    """
    content = fragment_text(fragment).encode()
    if path.exists():
        raise UsageError("there is a file of this name already", where=str(path), do="Give another `--out`")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_new(path, content)
    except OSError as error:
        raise EnvironmentFault(
            f"the calibration cannot be written: {error.strerror}", where=str(path), do="Give another --out"
        ) from None


def _check(text: str, name: str) -> None:
    """Raise ConfigError where the text holds what no rig may."""
    lent = files.read(files.find(COMPLETED_BY))
    own, origins = toml_text.parse(text, name)
    build(RigConfig, toml_text.merge(lent.data, own), origins, name)
