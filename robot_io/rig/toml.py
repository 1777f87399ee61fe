"""TOML as text: read it with the line of every key, write it back, and read one `key=value` of the command line.

Nothing here knows what a rig is. Keys are paths of names, for example ("base", "topics", "command").
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from robot_io.errors import ConfigError, UsageError

KeyPath = tuple[str, ...]
Origins = dict[KeyPath, str]
"""Where each key was written: `file:line`, or the option and the key."""

_MOST_CHARACTERS = 64 << 10
_MOST_DOTS = 200
"""In a key. `tomllib` takes memory by the square of a key's parts, and the text may come out of a log."""
_BETWEEN_KEYS = re.compile(r"[,={}\[\]\n\r]")
_HEADER = re.compile(r"(?:\[([^\[\]]+)\]|\[\[([^\[\]]+)\]\])\s*(?:#.*)?\Z")
"""Of a table, or of one in a list of tables."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_KEY = re.compile(r"([A-Za-z0-9_.\-\"' \t]+)=")


def parse(text: str, name: str) -> tuple[dict[str, Any], Origins]:
    """Return the tables of `text` and the origin (`name:line`) of each key; ConfigError when it is not TOML."""
    if len(text) > _MOST_CHARACTERS:
        raise ConfigError(f"{len(text)} characters are too many for a rig", where=name)
    if any(piece.count(".") > _MOST_DOTS for piece in _BETWEEN_KEYS.split(text)):
        raise ConfigError("this is nested too deeply to be a rig", where=name)
    try:
        data = tomllib.loads(text)
    except ValueError as error:  # a TOMLDecodeError, or an integer of thousands of digits
        # The message ends in "(at line 3, column 7)"; the place goes in front, as everywhere else.
        place = re.search(r" \(at line (\d+), column \d+\)$", str(error))
        line = int(place[1]) if place else text.count("\n") + 1
        what = str(error)[: place.start()] if place else str(error)
        raise ConfigError(f"this is not TOML: {what}", where=f"{name}:{line}", do="Fix that line") from None
    except RecursionError:
        raise ConfigError("this is nested too deeply to be a rig", where=name) from None
    return data, _origins(text, name)


def origin_of(path: KeyPath, origins: Origins, name: str) -> str:
    """Return where `path`, or else the nearest table around it, was written; `name` where neither was."""
    for depth in range(len(path), 0, -1):
        if path[:depth] in origins:
            return origins[path[:depth]]
    return name


def _origins(text: str, name: str) -> Origins:
    origins: Origins = {}
    table: KeyPath = ()
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if header := _HEADER.match(line):
            table = _split(header[1] or header[2])
            origins.setdefault(table, f"{name}:{number}")
        elif key := _KEY.match(line):
            origins.setdefault(table + _split(key[1]), f"{name}:{number}")
    return origins


def _split(dotted: str) -> KeyPath:
    return tuple(part.strip(" \t\"'") for part in dotted.split("."))


def parse_setting(setting: str, option: str = "--set") -> tuple[KeyPath, Any]:
    """Read `a.b=value`: the value is TOML; what is not TOML is a plain string. UsageError without a key or `=`.

    option: where it was given, for the error.
    """
    key, equals, text = setting.partition("=")
    path = _split(key)
    if not equals or not all(path):
        raise UsageError(
            f"`{setting}` is not of the form key=value", where=option, do=f"For example: {option} control.k_f=0.1"
        )
    text = text.strip()
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return path, text
    return path, parsed["value"] if len(parsed) == 1 else text


def put(data: dict[str, Any], path: KeyPath, value: Any, option: str = "--set") -> None:
    """Set `path` of the nested tables `data` to `value`, making the tables on the way; UsageError through a value."""
    table = data
    for depth, part in enumerate(path[:-1], start=1):
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise UsageError(f"`{'.'.join(path[:depth])}` is a value, not a table", where=f"{option} {'.'.join(path)}")
    table[path[-1]] = value


def merge(base: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` with the keys of `above` laid over it, table by table."""
    merged = dict(base)
    for key, value in above.items():
        below = merged.get(key)
        merged[key] = merge(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


def emit(data: Mapping[str, Any]) -> str:
    """Write nested tables as TOML, None left out; floats keep every bit (shortest text that reads back the same)."""
    lines: list[str] = []
    _emit_table(data, (), lines)
    return "\n".join(lines) + "\n"


def with_origins(text: str, origins: Origins) -> str:
    """Return what `emit` wrote with the origin of each value as a comment; one without has its default."""
    lines: list[str] = []
    table: KeyPath = ()
    for line in text.splitlines():
        if header := _HEADER.match(line):
            table = _split(header[1] or header[2])
        elif key := _KEY.match(line):
            line += f"  # {origins.get(table + _split(key[1]), 'default')}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def _emit_table(data: Mapping[str, Any], path: KeyPath, lines: list[str]) -> None:
    if path:
        lines += ["", f"[{'.'.join(map(_emit_key, path))}]"]
    lines += [
        f"{_emit_key(key)} = {_emit_value(value)}"
        for key, value in data.items()
        if value is not None and not isinstance(value, Mapping)
    ]
    for key, value in data.items():
        if isinstance(value, Mapping):
            _emit_table(value, (*path, key), lines)


def _emit_key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _emit_value(key)


def _emit_value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str():
            # A JSON string is a TOML basic string, but for DEL, which TOML wants escaped.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list() | tuple():
            return "[" + ", ".join(_emit_value(item) for item in value) + "]"
        case Mapping():
            pairs = (f"{_emit_key(key)} = {_emit_value(item)}" for key, item in value.items() if item is not None)
            return "{ " + ", ".join(pairs) + " }"
        case _:
            raise TypeError(f"no TOML form for {type(value).__name__}")
