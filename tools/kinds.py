"""Asks a driver of somebody else what it declares, in a process of its own: `python -m tools.kinds` (job on stdin).

Its code runs here only, and in the processes that build its devices; never in this program's other processes.
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

ANSWER_WITHIN_S = 20.0


class Told(msgspec.Struct, frozen=True):
    """What a class says of itself."""

    emulated: bool
    """It names an emulator."""
    facts: SensorFacts | None = None
    """What a sensor declares."""


class Question(msgspec.Struct, frozen=True):
    """The kinds to look at, by device, and where else their modules may be."""

    kinds: dict[str, str]
    folder: str
    status_fd: int = -1


SHORT_NAMES = {"robotiq-ft300": "ft300", "ur": "ur10", "ridgeback-rosbridge": "ridgeback"}


def name_of(kind: str) -> str:
    """Return what a device of this kind is called in messages and summaries."""
    return SHORT_NAMES.get(kind, kind)


def is_shipped(device: str, kind: str) -> bool:
    """Return whether a kind is one of this program's."""
    return kind in SHIPPED[device]


def ask(kinds: dict[str, str], folder: str) -> dict[str, Told]:
    """Return what each kind (by device: ft, arm, base) says of itself.

    Raises ConfigError: it cannot be found or imported, lacks a part, declares what is no `SensorFacts`, takes too long.
    """
    child = spawn("kinds", "tools.kinds", Question(kinds, folder), [])
    try:
        try:
            child.process.wait(ANSWER_WITHIN_S)
        except subprocess.TimeoutExpired:
            raise ConfigError(
                f"importing {_names(kinds)} took longer than {ANSWER_WITHIN_S:g} s",
                do="Open no device while the module is imported",
            ) from None
        child.hear()
        if child.errors:
            raise child.errors[0]
        if child.ready is None:
            raise ConfigError(
                f"importing {_names(kinds)} {child.how_it_ended()}", do="Import it in a Python of its own"
            )
        return msgspec.convert(child.ready["told"], dict[str, Told])
    finally:
        child.end(0.0)
        child.close()


def _names(kinds: dict[str, str]) -> str:
    return ", ".join(f"`{kind}`" for kind in kinds.values())


def told_by(device: str, found: type[Any], kind: str) -> Told:
    """Return what a class says of itself. Raises ConfigError for facts that are none."""
    emulated = hasattr(found, "Emulator")
    if device != "ft":
        return Told(emulated)
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
    return Told(emulated, facts)


def main() -> int:
    """Answer one question on the status pipe."""
    question = msgspec.json.decode(sys.stdin.buffer.read(), type=Question)
    status = StatusPipe(question.status_fd)
    try:
        told = {
            device: told_by(device, find_kind(device, kind, question.folder), kind)
            for device, kind in question.kinds.items()
        }
    except PushError as error:
        status.error(error)
        return error.exit_code
    status.say("ready", told=told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
