"""Laws that do not come with the program: `module:Class`, found on the Python path, beside the rig file, or here.

What such a law declares is read in a separate process, `python -m tools.laws` (job on stdin); its code runs only there
and where it steers: in the control process, in level sim, and in a replay that names it.
"""

from __future__ import annotations

import difflib
import hashlib
import importlib
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from control.laws.applied import AppliedLaw
from control.laws.law import Law
from control.laws.shipped import SHIPPED, build, is_shipped, law_name, settings_of
from control.laws.state_fields import StateFields
from robot_io.errors import ConfigError, PushError
from robot_io.ipc.spawn import spawn
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import NOT_FOUND, NOT_SOUND
from robot_io.rig.config import ControlConfig, RigConfig
from robot_io.rig.types import LawFacts

ANSWER_WITHIN_S = 20.0
PARTS = ("name", "Settings", "State", "initial", "step")
PAGE = "docs/own-law.md shows what a law needs"


class LawQuery(msgspec.Struct, frozen=True):
    """The law to query, with the rest of `[control]`, and another place to look for its module."""

    control: ControlConfig
    folder: str
    status_fd: int = -1


class LawAnswer(msgspec.Struct, frozen=True):
    """What a law declares, and its settings with every default filled in."""

    facts: LawFacts
    settings: dict[str, Any]


LawQuestion = Callable[[ControlConfig, str], LawAnswer]


def with_law(rig: RigConfig, folder: str, query: LawQuestion | None = None) -> RigConfig:
    """Return the rig with the settings of its law filled in, and what a law of one's own declares.

    query: asks a law of one's own; `query_law` by default. Raises ConfigError for a law that does not exist or cannot
    be used, and for settings that are not its own.
    """
    control = rig.control
    if is_shipped(control.law):
        found = settings_of(SHIPPED[control.law], control.law, control.law_settings)
        return replace(rig, control=replace(control, law_settings=msgspec.to_builtins(found), law_facts=LawFacts()))
    if ":" not in control.law:
        raise _unknown(control.law)
    answer = (query or query_law)(control, folder)
    return replace(rig, control=replace(control, law_settings=answer.settings, law_facts=answer.facts))


def query_law(control: ControlConfig, folder: str) -> LawAnswer:
    """Return what the law `module:Class` of `[control]` declares. Raises ConfigError if it cannot be used."""
    child = spawn("law", "tools.laws", LawQuery(control, folder), [])
    try:
        try:
            child.process.wait(ANSWER_WITHIN_S)
        except subprocess.TimeoutExpired:
            raise ConfigError(f"importing `{control.law}` took longer than {ANSWER_WITHIN_S:g} s") from None
        child.hear()
        if child.errors:
            raise child.errors[0]
        if child.ready is None:
            how = child.how_it_ended()
            raise ConfigError(f"importing `{control.law}` {how}", do="Import it in a separate Python process")
        return msgspec.convert(child.ready["told"], LawAnswer)
    finally:
        child.end(0.0)
        child.close()


def own_law(control: ControlConfig, folder: str) -> Law | None:
    """Import and build the law of `[control]`; None for a shipped one. Raises ConfigError if it cannot be used."""
    return None if is_shipped(control.law) else build_own(find_law(control.law, folder), control)


def find_law(law: str, folder: str) -> type[Any]:
    """Import the class that `module:Class` names; `folder` goes to the end of sys.path. Importing runs its code.

    Raises ConfigError: it cannot be imported, or a part is missing.
    """
    module, _, name = law.partition(":")
    if not name:
        raise _unknown(law)
    if folder not in sys.path:
        sys.path.append(folder)
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # somebody else's module may raise anything
        raise ConfigError(
            f"`{law}` cannot be imported: {_reason(error)}",
            where="control.law",
            do=NOT_FOUND if isinstance(error, ModuleNotFoundError) else NOT_SOUND,
        ) from error
    if not isinstance(found, type):
        raise ConfigError(f"`{law}` is not a class", where="control.law", do=PAGE)
    if missing := [part for part in PARTS if not hasattr(found, part)]:
        raise ConfigError(f"`{law}` lacks `{'`, `'.join(missing)}`", where="control.law", do=PAGE)
    for part in ("Settings", "State"):
        kind = getattr(found, part)
        if not (isinstance(kind, type) and issubclass(kind, msgspec.Struct) and kind.__struct_config__.frozen):
            raise ConfigError(f"the {part} of `{law}` is not a frozen msgspec.Struct", where="control.law", do=PAGE)
    return found


def build_own(found: type[Any], control: ControlConfig) -> Law:
    """Return a law of a class. Raises ConfigError for wrong settings, and for whatever it raises itself."""
    try:
        law = build(found, control)
        AppliedLaw(law)
    except PushError:
        raise
    except Exception as error:
        raise ConfigError(f"`{control.law}` failed: {_reason(error)}", where="control.law", do=PAGE) from error
    return law


def source_sha256(found: type[Any]) -> str:
    """Return the SHA-256 of the file that a class is in, hexadecimal; "" where there is no such file."""
    path = getattr(sys.modules.get(found.__module__), "__file__", None)
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest() if path else ""
    except OSError:
        return ""


def law_label(rig: RigConfig) -> str:
    """Return what the law of a rig is called in reports."""
    return rig.control.law_facts.name or law_name(rig.control.law)


def shipped_state(law: str) -> tuple[str, ...]:
    """Return the name of each number of a shipped law's state; none for any other law."""
    return StateFields(SHIPPED[law].State).names if law in SHIPPED else ()


def _declared(query: LawQuery) -> LawAnswer:
    control = query.control
    found = find_law(control.law, query.folder)
    applied = AppliedLaw(build_own(found, control))
    settings = msgspec.to_builtins(settings_of(found, control.law, control.law_settings))
    facts = LawFacts(str(found.name)[:100], source_sha256(found), applied.names)
    return LawAnswer(facts, settings)


def _unknown(law: str) -> ConfigError:
    near = difflib.get_close_matches(law, SHIPPED, n=1)
    hint = f"Did you mean `{near[0]}`? " if near else ""
    return ConfigError(
        f"there is no law `{law}`",
        where="control.law",
        do=f"{hint}Shipped: {', '.join(SHIPPED)}; your own: module:Class",
    )


def _reason(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]


def main() -> int:
    """Answer one query on the status pipe; return the exit code."""
    query = msgspec.json.decode(sys.stdin.buffer.read(), type=LawQuery)
    status = StatusPipe(query.status_fd)
    try:
        told = _declared(query)
    except PushError as error:
        status.error(error)
        return error.exit_code
    status.say("ready", told=told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
