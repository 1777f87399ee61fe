"""Let a rig take a calibration: edit its file in place, keep its comments, and keep the file as it was beside it."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from robot_io.errors import ConfigError, EnvironmentFault, UsageError
from robot_io.rig import files
from robot_io.rig import toml as toml_text
from robot_io.rig.files import INCLUDE, Written
from robot_io.rig.toml import KeyPath
from tools.places.atomic_file import write_atomically, write_new
from tools.rig import resolve_rig

CALIBRATION = "calibration"
BYTE_ORDER_MARK = "\ufeff"
BEFORE_INCLUDE = ("extends", "name", "description")
"""Keys at the top of a rig, below which `include` is written."""


def apply_fragment(rig_path: Path, fragment_path: Path) -> Path:
    """Include a fragment in a rig file; return where the file as it was is kept.

    The rig's own lines of the same keys become comments; earlier includes of them are left out. Nothing is written
    unless the rig can be used afterwards. Raises UsageError (a shipped rig, lines that cannot be edited), ConfigError
    and EnvironmentFault.
    """
    check_own(rig_path)
    before = _text(rig_path)
    after = included(before, rig_path, fragment_path)
    _check_usable(rig_path, after, fragment_path)
    target = rig_path.resolve()
    try:
        kept = _keep(target)
        write_atomically(target, after.encode(), mode=target.stat().st_mode & 0o7777)
    except OSError as error:
        raise EnvironmentFault(f"the rig cannot be edited: {error.strerror}", where=str(rig_path)) from None
    return kept


def check_own(rig_path: Path) -> None:
    """Raise UsageError for a rig that comes with the program, ConfigError where there is no such file."""
    found = files.find(str(rig_path))
    if found.resolve().parent == files.RIGS_DIR.resolve():
        name = found.stem
        raise UsageError(
            f"the rig `{name}` comes with the program and is not edited",
            where=str(rig_path),
            do=f'Write a rig of your own that says extends = "{name}", and give its file',
        )


def included(text: str, rig_path: Path, fragment_path: Path) -> str:
    """Return the rig file's text with the fragment included. Raises UsageError and ConfigError."""
    mark, text = (BYTE_ORDER_MARK, text[1:]) if text.startswith(BYTE_ORDER_MARK) else ("", text)
    own = Written(*toml_text.parse(text, str(rig_path)))
    fragment = files.read_fragment(fragment_path)
    lines = text.splitlines(keepends=True)
    newline = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    if lines and not lines[-1].endswith(newline):
        lines[-1] += newline
    name = _name(rig_path, fragment_path)
    line = toml_text.emit({INCLUDE: [*_other_includes(rig_path, own, fragment, fragment_path), name]})
    edits = [_include_line(lines, own, line.rstrip("\n") + newline)]
    for key in files.leaves(own.data):
        if _superseded(key, fragment):
            first, last = _span(lines, own, key)
            edits.append((first, last, [f"# replaced by {name}:{newline}", *_commented(lines[first:last])]))
    for first, last, new in sorted(edits, reverse=True):
        lines[first:last] = new
    return mark + "".join(lines)


def _name(rig_path: Path, fragment_path: Path) -> str:
    """Return the fragment's path as the rig names it: relative where the two are close."""
    fragment = fragment_path.resolve()
    name = os.path.relpath(fragment, rig_path.parent.resolve())
    return str(fragment) if name.startswith("../../") else name


def _superseded(key: KeyPath, fragment: Written) -> bool:
    """Return whether the fragment takes the place of a key: it sets it, or measured anew what the key tells of."""
    new = set(files.leaves(fragment.data))
    return key in new or (key[0] == CALIBRATION and key[:2] in {other[:2] for other in new})


def _other_includes(rig_path: Path, own: Written, fragment: Written, fragment_path: Path) -> list[str]:
    """Return the rig's other includes, without those whose place the fragment takes."""
    kept = []
    names, paths = own.data.get(INCLUDE, []), files.included_files(rig_path, own.data, own.origins)
    for name, path in zip(names, paths, strict=True):
        keys = list(files.leaves(files.read_fragment(path).data))
        others = [".".join(key) for key in keys if not _superseded(key, fragment) and key[0] != CALIBRATION]
        if path.resolve() == fragment_path.resolve():
            continue
        if not any(_superseded(key, fragment) for key in keys):
            kept.append(name)
        elif others:
            raise UsageError(
                f"it includes {name}, which the calibration replaces in part: that also sets `{others[0]}`",
                where=str(rig_path),
                do="Edit `include` by hand",
            )
    return kept


def _include_line(lines: list[str], own: Written, line: str) -> tuple[int, int, list[str]]:
    """Return which lines the `include` takes the place of, and those in their place; comments are kept."""
    if INCLUDE in own.data:
        first, last = _span(lines, own, (INCLUDE,))
        old = lines[first:last]
        return first, last, [*(_commented(old) if any("#" in one for one in old) else []), line]
    for key in BEFORE_INCLUDE:
        if key in own.data:
            _, last = _span(lines, own, (key,))
            return last, last, [line]
    first = min((_line_of(where) for where in own.origins.values()), default=0)
    return first, first, [line]


def _span(lines: list[str], own: Written, key: KeyPath) -> tuple[int, int]:
    """Return the lines of a key's value, the last one excluded. Raises UsageError where it has no line of its own."""
    where = own.origins.get(key, "")
    first = _line_of(where) if where else len(lines)
    for last in range(first + 1, len(lines) + 1):
        try:
            tomllib.loads("".join(lines[first:last]))
        except tomllib.TOMLDecodeError:
            continue
        return first, last
    raise UsageError(f"`{'.'.join(key)}` is not on a line of its own", do="Write it on one, or edit the rig by hand")


def _line_of(where: str) -> int:
    return int(where.rpartition(":")[2]) - 1


def _commented(lines: list[str]) -> list[str]:
    return [f"# {line}" for line in lines]


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read it: {error}", where=str(path)) from None


def _keep(path: Path) -> Path:
    """Copy the file to a name that is free, `rig.toml.bak` if it is; return it. Raises OSError."""
    kept, count = path.with_name(f"{path.name}.bak"), 2
    while kept.exists():
        kept, count = path.with_name(f"{path.name}.bak-{count}"), count + 1
    write_new(kept, path.read_bytes())
    return kept


def _check_usable(rig_path: Path, text: str, fragment_path: Path) -> None:
    """Raise ConfigError unless the rig can be used with this text, and nothing but the fragment's keys changes."""
    trial = rig_path.with_name(f".{rig_path.stem}.{os.getpid()}.trial.toml")
    fragment, before = files.read_fragment(fragment_path), _values(files.read(rig_path))
    try:
        trial.write_text(text, encoding="utf-8", newline="")
        resolve_rig(trial)
        after = _values(files.read(trial))
    except OSError as error:
        raise EnvironmentFault(f"the rig cannot be edited: {error.strerror}", where=str(rig_path)) from None
    except ConfigError as error:
        what = str(error).replace(str(trial), str(rig_path))
        raise ConfigError(f"with the calibration it could not be used: {what}", where=str(rig_path)) from None
    finally:
        trial.unlink(missing_ok=True)
    changed = {key for key in {*before, *after} if before.get(key) != after.get(key)}
    if strange := sorted(key for key in changed if not _superseded(key, fragment) and key[0] != CALIBRATION):
        raise UsageError(f"the edit would change `{'.'.join(strange[0])}`", where=str(rig_path), do="Edit it by hand")


def _values(written: Written) -> dict[KeyPath, Any]:
    found = {}
    for key in files.leaves(written.data):
        value: Any = written.data
        for part in key:
            value = value[part]
        found[key] = value
    return found
