"""Which settings of a rig can change what the ticks of a log compute; the others are refused by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec

from robot_io.errors import ConfigError, UsageError
from robot_io.rig.config import RigConfig, rig_from_toml, rig_to_toml
from robot_io.rig.toml import parse_setting
from tools.run.tick_core import TickCore

OPTION = "--what-if"
_DEVICES = "the log holds what the devices of then sent"
FIXED = {
    "world": "the simulated world is not run again; the log holds what it did",
    "faults": "the faults that were injected are in the log's measurements",
    "log": "what was recorded is in the log",
    "loop": "the ticks of a log keep the rate at which they ran",
    "ft.kind": _DEVICES,
    "ft.level": _DEVICES,
    "ft.options": _DEVICES,
    "ft.declared": _DEVICES,
    "arm.kind": _DEVICES,
    "arm.level": _DEVICES,
    "arm.options": _DEVICES,
    "arm.hold": "the log's arm was held as it was then",
    "base.kind": _DEVICES,
    "base.level": _DEVICES,
    "base.options": _DEVICES,
    "base.pose_source": "the log's poses come from where they came from then",
    "base.topics": _DEVICES,
    "control.law_facts": "it is what the law of then said of itself",
    "frames.base_from_marker": "the log's poses are already those of the base",
}
"""Keys and tables that say where a log's measurements came from, with the reason; a tick may read them all the same."""
_UNREAD = "it changes no setting of the law or the safety checks"


def other_rig(rig: RigConfig, settings: Sequence[str], core_of: Callable[[RigConfig], TickCore]) -> RigConfig:
    """Return the rig of a log with `key=value` settings laid over it; `core_of` makes the core of a rig.

    Raises UsageError for keys that cannot change a replay, and as `rig_from_toml` for the settings themselves.
    """
    text = rig_to_toml(rig)
    other = rig_from_toml(text, overrides=settings, option=OPTION)
    core = core_of(other)
    reasons = []
    for setting in settings:
        key = ".".join(parse_setting(setting, OPTION)[0])
        rest = [one for one in settings if one is not setting]
        reason = _fixed(key) or _unread(text, rest, other, core, core_of)
        if reason:
            reasons.append(f"`{key}` cannot change a replay: {reason}")
    if reasons:
        do = "Give keys of control, limits, path, workspace or frames; `push run --set` takes the others"
        raise UsageError("; ".join(dict.fromkeys(reasons)), where=OPTION, do=do)
    return other


def _fixed(key: str) -> str:
    """Return why a log fixes a key, "" if it does not."""
    return next((reason for name, reason in FIXED.items() if f"{key}.".startswith(f"{name}.")), "")


def _unread(
    text: str, rest: Sequence[str], other: RigConfig, core: TickCore, core_of: Callable[[RigConfig], TickCore]
) -> str:
    """Return why the setting missing in `rest` has no effect on a tick, "" if it has one or repeats the log's value."""
    try:
        without = rig_from_toml(text, overrides=rest, option=OPTION)
        same = msgspec.to_builtins(without) == msgspec.to_builtins(other)
        if same or core_of(without) != core:
            return ""
    except ConfigError:  # the others need it
        return ""
    return _UNREAD
