"""The law that a replay steers with: a shipped one, or one of one's own that the command line names.

A log never causes an import: what it says of its law is not looked for, only compared.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from control.laws.law import Law
from control.laws.shipped import is_shipped
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.rig.config import ControlConfig, RigConfig
from tools.laws import build_own, find_law, source_sha256
from tools.replay.code_origin import CodeOrigin
from tools.run.facts.run_facts import LAW_SOURCE_FACT
from tools.run.tick_core import TickCore

_SHOWN = 12


def check_given(log: Path, law: str, given: str) -> None:
    """Check `--law` against the law of a log. Raises EnvironmentFault without it, UsageError if not needed."""
    if not is_shipped(law) and not given:
        raise EnvironmentFault(
            f"the law of this log is `{law}`, and opening a log imports nothing",
            where=str(log),
            do=f"Add --law {law}, with its folder on PYTHONPATH or as the current one",
        )
    if is_shipped(law) and given:
        raise UsageError(f"the law of this log, `{law}`, comes with the program", where="--law", do="Leave out --law")


def law_of(log: Path, control: ControlConfig, given: str) -> tuple[Law | None, str]:
    """Return the law of `[control]`, and the SHA-256 of its source; None and "" for a shipped one.

    given: what `--law` names. Raises EnvironmentFault without it, UsageError if it is not needed, and ConfigError if it
    cannot be used. Importing runs its code.
    """
    check_given(log, control.law, given)
    if is_shipped(control.law):
        return None, ""
    found = find_law(given, str(Path.cwd()))
    return build_own(found, replace(control, law=given)), source_sha256(found)


def core_maker(log: Path, control: ControlConfig, given: str, *, in_contact: bool) -> Callable[[RigConfig], TickCore]:
    """Return what makes the core of a log's rig, and of that rig with other settings.

    control: of the log. given: what `--law` names. Another law of one's own than the log's was named by the settings,
    which is as good. Raises as `check_given`; what it returns raises as `law_of`.
    """
    check_given(log, control.law, given)

    def core(rig: RigConfig) -> TickCore:
        named = given if rig.control.law == control.law else rig.control.law
        law, _ = law_of(log, rig.control, "" if is_shipped(rig.control.law) else named)
        return TickCore.of(rig, in_contact=in_contact, law=law)

    return core


def with_law_source(made_by: CodeOrigin, facts: dict[str, str], sha256: str) -> CodeOrigin:
    """Return the origin of a log's code, which is other code too where its law's source was another one."""
    words = other_source(facts, sha256)
    return replace(made_by, other=True, code=f"{made_by.code}; {words}") if words else made_by


def other_source(facts: dict[str, str], sha256: str) -> str:
    """Return in words that the source of a log's law is not today's, "" where it is or the law is a shipped one."""
    logged = facts.get(LAW_SOURCE_FACT, "")
    if not sha256 or logged == sha256:
        return ""
    return f"its law's source had SHA-256 {logged[:_SHOWN] or 'unknown'}, today's has {sha256[:_SHOWN]}"
