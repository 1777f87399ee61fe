"""One device of `push watch`, in a process of its own: `python -m tools.watch.device_process` (job on stdin).

It opens the device, passes on what it gives, and opens it again when it is lost; so a device that takes long, hangs or
aborts its library holds up neither the others nor the screen. Nothing moves: the arm is opened with `hold = "monitor"`,
which sends it nothing, and the base is subscribed to, never advertised or published to.
"""

from __future__ import annotations

import signal
import socket
import sys
import time
from typing import Any, Protocol, Self

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.driver import Driver
from robot_io.errors import DeviceError, DeviceUnreachable, PushError
from robot_io.ipc.process import die_with_parent
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import build_driver, started
from robot_io.messages import LinkState
from robot_io.rig.config import RigConfig, rig_from_toml
from tools.watch.reports import DeviceReport, ReportSender

POLL_S = 0.01
REPORT_NS = 50 * NS_PER_MS
AGAIN_S = 2.0
"""Pause before a device that was lost, or could not be opened, is tried again."""
QUIET_NS = 3 * NS_PER_S
"""A bridge from which nothing has come for this long is connected to again."""


class WatchJob(msgspec.Struct, frozen=True):
    """What to watch."""

    rig_toml: str
    kind_folder: str
    device: str
    """ft, arm or base."""
    report_fd: int
    parent_pid: int
    status_fd: int = -1


class Watched(Protocol):
    """An open device; `with` closes it. `report` raises DeviceError when the device is lost."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *_: object) -> None: ...
    def report(self) -> DeviceReport:
        """Return what came since the last time."""
        ...


class WatchedDriver:
    """A sensor or an arm, by its driver. Raises DeviceError when it cannot be opened."""

    def __init__(self, device: str, driver: Driver[Any], kind: str) -> None:
        self._device = device
        self._driver = driver
        try:
            started(driver, device, kind)
        except BaseException:
            driver.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._driver.stop()
        self._driver.close()

    def report(self) -> DeviceReport:
        """Return what came since the last time. Raises DeviceUnreachable when the link is lost."""
        samples, health = self._driver.drain(), self._driver.health()
        if health.state == LinkState.LOST:
            raise DeviceUnreachable(health.cause or "its link is lost")
        given = {self._device: samples}
        return DeviceReport(self._device, "up", health.cause, ft=given.get("ft", ()), arm=given.get("arm", ()))


class WatchedBase:
    """A Ridgeback behind its bridge, only listened to. Raises DeviceError as `RidgebackLook`."""

    def __init__(self, rig: RigConfig) -> None:
        from robot_io.ridgeback.look import RidgebackLook

        base = rig.base
        self._look = RidgebackLook(base.url, base.topics, base.pose_source, rig.frames.base_from_marker)
        self._since_ns = monotonic_ns()
        try:
            self._intake = self._look.subscribe()
        except BaseException:
            self._look.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._look.close()

    def report(self) -> DeviceReport:
        """Return what came since the last time. Raises DeviceUnreachable where nothing comes any more."""
        now_ns = monotonic_ns()
        samples = self._look.heard_by(self._intake, now_ns)
        if now_ns - max(self._since_ns, self._intake.newest_inbound_ns) > QUIET_NS:
            raise DeviceUnreachable(f"nothing has come from the bridge for {QUIET_NS / NS_PER_S:g} s")
        return DeviceReport("base", "up", base=tuple(samples))


def open_watched(rig: RigConfig, device: str, kind_folder: str) -> Watched:
    """Open a device to look at. Raises PushError."""
    if device == "base":
        return WatchedBase(rig)
    if device == "arm":
        from robot_io.ur10.driver import Ur10

        return WatchedDriver("arm", Ur10(rig.arm.host, hold="monitor"), rig.arm.kind)
    driver = build_driver("ft", rig.ft.kind, rig.ft.port, rig.ft.options, folder=kind_folder)
    return WatchedDriver("ft", driver, rig.ft.kind)


def watch(rig: RigConfig, job: WatchJob, reports: ReportSender) -> None:
    """Pass on what the device gives, until SystemExit."""
    cause = ""
    while True:
        reports.send(DeviceReport(job.device, "opening", cause))
        try:
            with open_watched(rig, job.device, job.kind_folder) as watched:
                pass_on(watched, reports)
        except DeviceError as error:
            cause = str(error)
            reports.send(DeviceReport(job.device, "lost", cause))
        time.sleep(AGAIN_S)


def pass_on(watched: Watched, reports: ReportSender) -> None:
    """Report until the device is lost, which raises DeviceError."""
    told_ns, waiting = 0, list[DeviceReport]()
    while True:
        waiting.append(watched.report())
        now_ns = monotonic_ns()
        if now_ns - told_ns >= REPORT_NS:
            told_ns = now_ns
            reports.send(joined(waiting))
            waiting.clear()
        time.sleep(POLL_S)


def joined(reports: list[DeviceReport]) -> DeviceReport:
    """Return several reports of one device, oldest first, as one."""
    newest = reports[-1]
    return DeviceReport(
        newest.device,
        newest.state,
        newest.cause,
        tuple(sample for report in reports for sample in report.ft),
        tuple(sample for report in reports for sample in report.arm),
        tuple(sample for report in reports for sample in report.base),
    )


def main() -> int:
    """Serve until SIGTERM; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=WatchJob)
    signal.signal(signal.SIGTERM, _end)
    die_with_parent(job.parent_pid, signal.SIGTERM)
    try:
        watch(rig_from_toml(job.rig_toml), job, ReportSender(socket.socket(fileno=job.report_fd)))
    except PushError as error:  # a driver of somebody else that cannot be used
        StatusPipe(job.status_fd).error(error)
        return error.exit_code
    return 0


def _end(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once: the device is being closed
    sys.exit(0)


if __name__ == "__main__":
    sys.exit(main())
