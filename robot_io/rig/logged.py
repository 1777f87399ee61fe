"""The rig out of a log's config.toml, also of an earlier format: old keys are mapped by the table of `renames`."""

from __future__ import annotations

from typing import Any, NamedTuple

from robot_io.rig import renames
from robot_io.rig import toml as toml_text
from robot_io.rig.checks import build
from robot_io.rig.config import RigConfig


class LoggedRig(NamedTuple):
    """The rig of a log, and in words what of its config means nothing today."""

    rig: RigConfig
    notes: tuple[str, ...]


def rig_of_log(text: str, log_format: int, name: str = "config.toml") -> LoggedRig:
    """Read the config of a log. Raises ConfigError, with `name` as its place, when it is none of that format."""
    data, origins = toml_text.parse(text, name)
    for old, new, last_format, still_read in renames.RENAMED:
        if (log_format <= last_format or still_read) and (found := _taken(data, old)):
            toml_text.put(data, _path(new), found[0])
    ignored = [
        key for key, last_format in renames.RETIRED if log_format <= last_format and _taken(data, key) is not None
    ]
    for key, value, last_format in renames.EARLIER_DEFAULTS:
        if log_format <= last_format and not _holds(data, key):
            toml_text.put(data, _path(key), value)
    rig = build(RigConfig, data, origins, name)
    return LoggedRig(rig, tuple(f"the log's `{key}` means nothing today and was ignored" for key in ignored))


def _path(key: str) -> tuple[str, ...]:
    return tuple(key.split("."))


def _table(data: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the table that would hold `key`; an empty one when there is none."""
    table: Any = data
    for part in _path(key)[:-1]:
        table = table.get(part)
        if not isinstance(table, dict):
            return {}
    found: dict[str, Any] = table
    return found


def _holds(data: dict[str, Any], key: str) -> bool:
    return _path(key)[-1] in _table(data, key)


def _taken(data: dict[str, Any], key: str) -> tuple[Any] | None:
    """Take `key` out of the tables; None when it is not there."""
    return (_table(data, key).pop(_path(key)[-1]),) if _holds(data, key) else None
