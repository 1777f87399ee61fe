"""Why a run did not begin: everything the processes said, as one error."""

from __future__ import annotations

from typing import NamedTuple

from robot_io.errors import ConfigError, DeviceError, EnvironmentFault, PushError
from robot_io.ipc.spawn import Child
from robot_io.rig.config import RigConfig
from tools.kinds import name_of

KINDS: dict[int, type[PushError]] = {kind.exit_code: kind for kind in (ConfigError, EnvironmentFault, DeviceError)}
ORDER = ("control", "arm", "gate")
"""The processes that open sensor, arm and base."""


class Failure(NamedTuple):
    """What one process said."""

    name: str
    code: int
    what: str
    where: str
    do: str


def combined(failed: list[Child], rig: RigConfig) -> PushError:
    """Return one error that names every device that failed, and what to do about each.

    Its exit code is theirs, 4 when they are of several kinds.
    """
    found = [failure for child in failed for failure in _failures(child)]
    found.sort(key=lambda failure: ORDER.index(failure.name) if failure.name in ORDER else len(ORDER))
    codes = {failure.code for failure in found}
    kind = KINDS.get(codes.pop(), PushError) if len(codes) == 1 else DeviceError
    if len(found) == 1:
        only = found[0]
        return kind(only.what, where=_named(only.name, only.where, rig), do=only.do)
    what = "; ".join(f"{_named(failure.name, failure.where, rig)}: {failure.what}" for failure in found)
    do = "; ".join(f"{_device(failure.name, rig)}: {failure.do}" for failure in found if failure.do)
    return kind(what, do=do)


def not_in_time(waiting: list[Child], rig: RigConfig) -> DeviceError:
    """Return the error of processes that neither became ready nor failed."""
    names = ", ".join(f"{_device(child.name, rig)} (process {child.pid})" for child in waiting)
    return DeviceError(f"not ready in time: {names}", do="Look at what this machine is busy with, and try again")


def _failures(child: Child) -> list[Failure]:
    said = [
        Failure(
            child.name,
            int(error.get("code", EnvironmentFault.exit_code)),
            str(error.get("what", "")),
            str(error.get("where", "")),
            str(error.get("do", "")),
        )
        for error in child.errors
    ]
    if said:
        return said
    do = f"This is a defect of the program; all it said is in {child.keep_words()}" if child.last_words() else ""
    return [Failure(child.name, PushError.exit_code, f"its process {child.how_it_ended()}", "", do)]


def _device(name: str, rig: RigConfig) -> str:
    """Return the device that a process opens, or the process's own name."""
    kinds = {"control": rig.ft.kind, "arm": rig.arm.kind, "gate": rig.base.kind}
    return name_of(kinds[name]) if name in kinds else name


def _named(name: str, where: str, rig: RigConfig) -> str:
    """Return the place with the device's name in front, once."""
    device = _device(name, rig)
    return where if where.startswith(device) else f"{device} {where}".strip()
