"""Rig files: which file a rig is, the rig that it extends, and the files that it includes.

A file may say `extends = "emulated"` and then holds only what differs. It may say `include = ["a.toml", "b.toml"]` and
takes the keys of those files, which must be its own nowhere and in one of them only. First comes the extended rig, then
what is included, then the file's own keys. Paths are relative to the file that names them.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from robot_io.errors import ConfigError
from robot_io.rig import toml as toml_text
from robot_io.rig.renames import use_todays_names
from robot_io.rig.toml import KeyPath, Origins

RIGS_DIR = Path(__file__).parent
INCLUDE, EXTENDS = "include", "extends"


class Written(NamedTuple):
    """Nested tables, and where each of their keys was written."""

    data: dict[str, Any]
    origins: Origins


def shipped_rigs() -> list[str]:
    """Return the names of the rigs that come with the program."""
    return sorted(path.stem for path in RIGS_DIR.glob("*.toml"))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a shipped name or a path. Raises ConfigError where there is none."""
    text = str(name_or_path)
    if text in (shipped := shipped_rigs()):
        return RIGS_DIR / f"{text}.toml"
    path = _expanded(text)
    if _is_file(path):
        return path
    if path.suffix == ".toml" or "/" in text:
        raise ConfigError("there is no such rig file", where=text, do="Check the name")
    near = difflib.get_close_matches(text, shipped, n=1)
    hint = f"Did you mean `{near[0]}`? " if near else ""
    raise ConfigError(
        f"there is no rig named `{text}`", do=f"{hint}Shipped rigs: {', '.join(shipped)}; or give the path of a file"
    )


def read(path: Path) -> Written:
    """Return the tables of the rig file `path`, and where each key was written.

    Raises ConfigError: a file that cannot be read, that extends itself, whose `include` is not a list of files, or two
    files that set the same key.
    """
    return _read(path, ())


def read_fragment(path: Path) -> Written:
    """Return the tables of a file to include. Raises ConfigError where it includes or extends another itself."""
    fragment = _parse(path)
    for key in (INCLUDE, EXTENDS):
        if key in fragment.data:
            raise ConfigError(
                f"a file that is included cannot say `{key}`",
                where=toml_text.origin_of((key,), fragment.origins, str(path)),
                do=f"Say `{key}` in the rig file",
            )
    return fragment


def leaves(data: Mapping[str, Any], path: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the path of every value of nested tables."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def _read(path: Path, seen: tuple[Path, ...]) -> Written:
    if path.resolve() in seen:
        raise ConfigError("this rig extends itself", where=str(path))
    data, origins = _parse(path)
    below = Written({}, {})
    if EXTENDS in data:
        base = data.pop(EXTENDS)
        if not isinstance(base, str):
            where = toml_text.origin_of((EXTENDS,), origins, str(path))
            raise ConfigError("`extends` names a rig: a shipped name or a path", where=where)
        beside = path.parent / _expanded(base)
        below = _read(beside if _is_file(beside) else find(base), (*seen, path.resolve()))
    included = [read_fragment(file) for file in included_files(path, data, origins)]
    data.pop(INCLUDE, None)
    _check_apart([*included, Written(data, origins)], path)
    for part in (*included, Written(data, origins)):
        below = Written(toml_text.merge(below.data, part.data), below.origins | part.origins)
    return below


def included_files(path: Path, data: Mapping[str, Any], origins: Origins) -> list[Path]:
    """Return the files that the rig file `path` with these tables includes, in order. Raises ConfigError."""
    names = data.get(INCLUDE, [])
    where = toml_text.origin_of((INCLUDE,), origins, str(path))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ConfigError('`include` is a list of files, as in include = ["calibration/frame.toml"]', where=where)
    files = [path.parent / _expanded(name) for name in names]
    for file in files:
        if not _is_file(file):
            raise ConfigError(f"there is no file {file} to include", where=where)
    return files


def _check_apart(parts: list[Written], rig: Path) -> None:
    """Raise ConfigError where two of the parts of a rig file set the same key, naming the lines of both."""
    first: dict[KeyPath, str] = {}
    twice = []
    for part in parts:
        set_here = {key: toml_text.origin_of(key, part.origins, "") for key in leaves(part.data)}
        twice += [(set_here[key], ".".join(key), first[key]) for key in set_here if key in first]
        first = set_here | first
    if not twice:
        return
    if len(twice) == 1:
        where, key, other = twice[0]
        do = "Leave it out of one of the two: neither overrides the other"
        raise ConfigError(f"`{key}` is also set at {other}", where=where, do=do)
    listed = "".join(f"\n  {where}: `{key}` is also set at {other}" for where, key, other in twice)
    raise ConfigError(f"{len(twice)} keys are set twice, and neither file overrides the other{listed}", where=str(rig))


def _parse(path: Path) -> Written:
    try:
        text = path.read_text(encoding="utf-8-sig")  # a byte order mark, as some editors write, is not a mistake
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read it: {error}", where=str(path)) from None
    data, origins = toml_text.parse(text, str(path))
    use_todays_names(data, origins, str(path))
    return Written(data, origins)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError as error:  # a folder that is not ours to look into, a name that is too long
        raise ConfigError(f"cannot read it: {error.strerror}", where=str(path)) from None


def _expanded(name: str) -> Path:
    try:
        return Path(name).expanduser()
    except RuntimeError:
        raise ConfigError("there is no user of this name", where=name) from None
