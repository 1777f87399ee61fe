"""Read what external drivers declare, in a separate process: `python -m tools.kinds` (job on stdin).

Their code runs only here and in the processes that build their devices, never in this program's other processes.
"""

from __future__ import annotations

import math
import subprocess
import sys
from typing import Any

import msgspec

from robot_io.driver import SensorFacts
from robot_io.errors import ConfigError, PushError
from robot_io.ipc.spawn import spawn
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import SHIPPED, find_kind
from robot_io.rig.config import RigConfig

ANSWER_WITHIN_S = 20.0


class KindFacts(msgspec.Struct, frozen=True):
    """What a driver class declares."""

    emulated: bool
    """Whether it has an emulator."""
    facts: SensorFacts | None = None
    """Facts of a sensor."""


class KindQuery(msgspec.Struct, frozen=True):
    """The kinds to query, by device, and another place to look for their modules."""

    kinds: dict[str, str]
    folder: str
    status_fd: int = -1


SHORT_NAMES = {
    "robotiq-ft300": "ft300",
    "ur-tool-force": "tool-force",
    "ur": "ur10",
    "ridgeback-rosbridge": "ridgeback",
}


def name_of(kind: str) -> str:
    """Return the name of a device of this kind in messages and summaries."""
    return SHORT_NAMES.get(kind, kind)


def device_names(rig: RigConfig) -> tuple[str, str, str]:
    """Return the names of a rig's sensor, arm and base."""
    return name_of(rig.ft.kind), name_of(rig.arm.kind), name_of(rig.base.kind)


def is_shipped(device: str, kind: str) -> bool:
    """Return whether a kind is part of this program."""
    return kind in SHIPPED[device]


def query_kinds(kinds: dict[str, str], folder: str) -> dict[str, KindFacts]:
    """Return what each kind (by device: ft, arm, base) declares.

    Raises ConfigError if a kind cannot be found or imported, lacks a part, declares facts that are not `SensorFacts`,
    or takes too long.
    """
    child = spawn("kinds", "tools.kinds", KindQuery(kinds, folder), [])
    try:
        try:
            child.process.wait(ANSWER_WITHIN_S)
        except subprocess.TimeoutExpired:
            raise ConfigError(
                f"importing {_names(kinds)} took longer than {ANSWER_WITHIN_S:g} s",
                do="Open no device during import",
            ) from None
        child.hear()
        if child.errors:
            raise child.errors[0]
        if child.ready is None:
            raise ConfigError(
                f"importing {_names(kinds)} {child.how_it_ended()}",
                do="Import it in a separate Python process",
            )
        return msgspec.convert(child.ready["told"], dict[str, KindFacts])
    finally:
        child.end(0.0)
        child.close()


def _names(kinds: dict[str, str]) -> str:
    return ", ".join(f"`{kind}`" for kind in kinds.values())


def kind_facts(device: str, found: type[Any], kind: str) -> KindFacts:
    """Return what a class declares. Raises ConfigError for invalid facts."""
    emulated = hasattr(found, "Emulator")
    if device != "ft":
        return KindFacts(emulated)
    try:
        facts = msgspec.convert(msgspec.to_builtins(found.facts), SensorFacts)
    except (msgspec.ValidationError, TypeError, ValueError) as error:
        raise ConfigError(
            f"the `facts` of `{kind}` are not SensorFacts: {error}",
            where=f"{device}.kind",
            do="docs/add-a-device.md shows what a sensor declares",
        ) from None
    if not all(map(math.isfinite, (*facts.range, facts.rate_hz, *facts.resolution, *facts.noise))):
        raise ConfigError(f"the `facts` of `{kind}` hold a number that is not finite", where=f"{device}.kind")
    return KindFacts(emulated, facts)


def main() -> int:
    """Answer one query on the status pipe; return the exit code."""
    question = msgspec.json.decode(sys.stdin.buffer.read(), type=KindQuery)
    status = StatusPipe(question.status_fd)
    try:
        declared = {
            device: kind_facts(device, find_kind(device, kind, question.folder), kind)
            for device, kind in question.kinds.items()
        }
    except PushError as error:
        status.error(error)
        return error.exit_code
    status.say("ready", told=declared)
    return 0


if __name__ == "__main__":
    sys.exit(main())
