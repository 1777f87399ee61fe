"""Keys of a rig that had another name, meaning or place once: one line each.

A rig file must use today's names, and an old one's error says which that is; a few old names are still read, with a
note. The config in a log is mapped by the log's format, so that the logs of all earlier programs can be read. Keys are
dotted: `ft.tare_s`.
"""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

_NOTES = logging.getLogger(__name__)


class Renamed(NamedTuple):
    """Logs up to `last_format` call it `old`, later ones and rig files `new`."""

    old: str
    new: str
    last_format: int
    still_read: bool = False
    """Whether a rig file may use the old name, too."""


class Retired(NamedTuple):
    """Logs up to `last_format` may hold this key, which means nothing today."""

    key: str
    last_format: int


class EarlierDefault(NamedTuple):
    """A log up to `last_format` that lacks this key meant `value`, whatever today's default is."""

    key: str
    value: Any
    last_format: int


RENAMED = (
    Renamed("ft.tare_seconds_s", "ft.tare_s", 1),
    Renamed("limits.hold_slow_rad", "limits.drift_hold_rad", 1),
    Renamed("limits.hold_stop_rad", "limits.drift_stop_rad", 1),
    Renamed("control.controller", "control.law", 3, still_read=True),
)
RETIRED = (Retired("base.odometry_rate_hz", 1),)
EARLIER_DEFAULTS: tuple[EarlierDefault, ...] = (
    EarlierDefault("world.slip", 0.0, 2),
    EarlierDefault("world.floor.push_height_m", 0.0, 4),
    EarlierDefault("world.floor.turning", "ellipsoid", 4),
)


def name_today(path: tuple[str, ...], where: str) -> tuple[str, ...]:
    """Return the path of a key that a person wrote, with a note (a log message) if it has an old name still read."""
    key = ".".join(path)
    for renamed in RENAMED:
        if renamed.still_read and key == renamed.old:
            _NOTES.warning("%s: `%s` is read as `%s`, which is its name now", where, renamed.old, renamed.new)
            return tuple(renamed.new.split("."))
    return path


def use_todays_names(data: dict[str, Any], origins: dict[tuple[str, ...], str], name: str) -> None:
    """Give the keys of a rig file (tables in `data`) that have an old name still read today's name, with a note."""
    for renamed in RENAMED:
        if not renamed.still_read:
            continue
        (table, old), new = renamed.old.split("."), renamed.new.split(".")[1]
        held = data.get(table)
        if isinstance(held, dict) and old in held and new not in held:
            where = origins.pop((table, old), name)
            held[name_today((table, old), where)[1]] = held.pop(old)
            origins[table, new] = where


def advice(key: str) -> str:
    """Return what a person who wrote `key` should know, or "" when it never was a key."""
    for renamed in RENAMED:
        if key == renamed.old:
            return f"`{key}` is called `{renamed.new}` now"
    if any(key == retired.key for retired in RETIRED):
        return f"`{key}` is no longer a key: leave it out"
    return ""
