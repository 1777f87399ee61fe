"""Why a run did not start: the errors of all processes, combined into one."""

from __future__ import annotations

import signal
from typing import NamedTuple

from robot_io.errors import ConfigError, DeviceError, EnvironmentFault, PushError
from robot_io.ipc.spawn import Child
from robot_io.rig.config import RigConfig
from tools.kinds import name_of

KINDS: dict[int, type[PushError]] = {kind.exit_code: kind for kind in (ConfigError, EnvironmentFault, DeviceError)}
ORDER = ("control", "arm", "gate")
"""The processes that open sensor, arm and base."""

KILLED_BY_OTHERS = (-signal.SIGKILL, -signal.SIGTERM)
DO_WHEN_KILLED = "Somebody or the system ended it: see whether memory ran out (`dmesg`), then try again"


class Failure(NamedTuple):
    """The error of one process."""

    name: str
    error: PushError


def combined_error(failed: list[Child], rig: RigConfig) -> PushError:
    """Return one error that names every device that failed and what to do about each.

    Its exit code is the one they share, or 4 if they differ.
    """
    found = [failure for child in failed for failure in _failures(child)]
    found.sort(key=lambda failure: ORDER.index(failure.name) if failure.name in ORDER else len(ORDER))
    codes = {error.exit_code for _, error in found}
    kind = KINDS.get(codes.pop(), PushError) if len(codes) == 1 else DeviceError
    if len(found) == 1:
        name, only = found[0]
        return kind(only.what, where=_with_device_name(name, only.where, rig), do=only.do)
    what = "; ".join(f"{_with_device_name(name, error.where, rig)}: {error.what}" for name, error in found)
    do = "; ".join(f"{_device(name, rig)}: {error.do}" for name, error in found if error.do)
    return kind(what, do=do)


def start_timeout(waiting: list[Child], rig: RigConfig) -> DeviceError:
    """Return the error of processes that neither became ready nor failed."""
    names = ", ".join(f"{_device(child.name, rig)} (process {child.pid})" for child in waiting)
    return DeviceError(f"not ready in time: {names}", do="Check what this machine is busy with, and try again")


def _failures(child: Child) -> list[Failure]:
    if child.errors:
        return [Failure(child.name, error) for error in child.errors]
    if child.process.returncode in KILLED_BY_OTHERS:
        return [Failure(child.name, EnvironmentFault(f"its process {child.how_it_ended()}", do=DO_WHEN_KILLED))]
    do = f"This is a bug in the program; its output is in {child.save_stderr()}" if child.last_stderr_line() else ""
    return [Failure(child.name, PushError(f"its process {child.how_it_ended()}", do=do))]


def _device(name: str, rig: RigConfig) -> str:
    """Return the name of the device that a process opens, or the process's own name."""
    kinds = {"control": rig.ft.kind, "arm": rig.arm.kind, "gate": rig.base.kind}
    return name_of(kinds[name]) if name in kinds else name


def _with_device_name(name: str, where: str, rig: RigConfig) -> str:
    """Return `where` with the device's name in front, unless it is there already."""
    device = _device(name, rig)
    return where if where.startswith(device) else f"{device} {where}".strip()
