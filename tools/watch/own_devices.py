"""Opens the devices of a rig to watch them: a process for each, whose reports come over one link."""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from robot_io.ipc.spawn import Child, spawn
from robot_io.rig.config import RigConfig, rig_to_toml
from tools.kinds import is_shipped
from tools.rig import kinds_of
from tools.watch.device_process import WatchJob
from tools.watch.reports import DeviceReport, Report, report_link
from tools.watch.seen import DEVICES

ENDS_WITHIN_S = 4.0
"""The sensor's stream is stopped (1.1 s), the arm's own process has 3 s."""


class OwnDevices:
    """The processes of a rig's devices; `with` ends them.

    held: who holds a device, in words, for each that another program has; it is not opened.
    """

    def __init__(self, rig: RigConfig, kind_folder: str, held: Mapping[str, str]) -> None:
        self.reports, far = report_link()
        self._children: dict[str, Child] = {}
        self._told: list[Report] = []
        try:
            for device in DEVICES:
                if reason := _left_out(rig, device, held):
                    self._told.append(DeviceReport(device, "not watched", reason))
                    continue
                job = WatchJob(rig_to_toml(rig), kind_folder, device, far.fileno(), os.getpid())
                self._children[device] = spawn(f"{device}-watch", "tools.watch.device_process", job, [far.fileno()])
        except BaseException:
            self.close()
            raise
        finally:
            far.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def read(self) -> list[Report]:
        """Return what the processes have told since the last call; also which of them has ended."""
        told, self._told = [*self._told, *self.reports.read()], []
        for device, child in list(self._children.items()):
            if child.process.poll() is not None:
                self._children.pop(device)
                child.hear()
                why = str(child.errors[-1]) if child.errors else f"its process {child.how_it_ended()}"
                told.append(DeviceReport(device, "lost", why))
                child.close()
        return told

    def close(self) -> None:
        """End all processes: the sensor's stream is stopped, connections are closed. Idempotent."""
        for child in self._children.values():
            child.terminate()
        for child in self._children.values():
            child.stop(ENDS_WITHIN_S)
            child.close()
        self._children.clear()
        self.reports.close()


def _left_out(rig: RigConfig, device: str, held: Mapping[str, str]) -> str:
    """Return why a device is not opened, "" where it is."""
    if device in held:
        return f"in use by {held[device]}"
    kind = kinds_of(rig)[device]
    if device != "ft" and not is_shipped(device, kind):
        return f"`{kind}` is not of this program, and its driver might send it something"
    return ""
