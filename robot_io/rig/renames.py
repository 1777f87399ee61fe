"""Keys of a rig that had another name, meaning or place once: one line each.

A rig file must use today's names, and an old one's error says which that is. The config in a log is mapped by the log's
format, so that the logs of all earlier programs can be read. Keys are dotted: `ft.tare_s`.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Renamed(NamedTuple):
    """Logs up to `last_format` call it `old`, later ones and rig files `new`."""

    old: str
    new: str
    last_format: int


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
)
RETIRED = (Retired("base.odometry_rate_hz", 1),)
EARLIER_DEFAULTS: tuple[EarlierDefault, ...] = (EarlierDefault("world.slip", 0.0, 2),)


def advice(key: str) -> str:
    """Return what a person who wrote `key` should know, or "" when it never was a key."""
    for renamed in RENAMED:
        if key == renamed.old:
            return f"`{key}` is called `{renamed.new}` now"
    if any(key == retired.key for retired in RETIRED):
        return f"`{key}` is no longer a key: leave it out"
    return ""
