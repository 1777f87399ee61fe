"""The laws that come with the program, by the word that a rig has for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from control.laws.force import ForceFeedback
from control.laws.force_integral import ForceIntegral
from control.laws.law import Law
from control.laws.line import Line
from control.laws.open_loop import OpenLoop
from robot_io.errors import ConfigError
from robot_io.rig.config import ControlConfig

SHIPPED: dict[str, type[Any]] = {
    "force": ForceFeedback,
    "open-loop": OpenLoop,
    "line": Line,
    "force-integral": ForceIntegral,
}


def is_shipped(law: str) -> bool:
    """Return whether a law is part of this program."""
    return law in SHIPPED


def shipped_law(control: ControlConfig) -> Law:
    """Return the law of a rig. Raises ConfigError if it is not a shipped one, or for settings that are not its own."""
    if control.law not in SHIPPED:
        raise ConfigError(f"the law `{control.law}` is not part of this program", where="control.law")
    return build(SHIPPED[control.law], control)


def build(kind: type[Any], control: ControlConfig) -> Law:
    """Return a law of a class, with the settings that its rig has for it. Raises ConfigError as `settings_of`."""
    made: Law = kind(control, settings_of(kind, control.law, control.law_settings))
    return made


def settings_of(kind: type[Any], law: str, table: Mapping[str, Any]) -> msgspec.Struct:
    """Return `[control.law_settings]` as the Settings of a law's class.

    Raises ConfigError for a key it does not have, and for a value of another type or out of range.
    """
    known = [field.name for field in msgspec.structs.fields(kind.Settings)]
    for key in table:
        if key not in known:
            these = f"it has {', '.join(known)}" if known else "it has none"
            raise ConfigError(f"`{key}` is not a setting of the law `{law}`: {these}", where="control.law_settings")
    try:
        made: msgspec.Struct = msgspec.convert(dict(table), kind.Settings)
    except msgspec.ValidationError as error:
        raise ConfigError(f"the law `{law}`: {error}", where="control.law_settings") from None
    return made


def law_name(law: str) -> str:
    """Return what a shipped law is called in reports, and any other by the word for it."""
    return str(SHIPPED[law].name) if law in SHIPPED else law
