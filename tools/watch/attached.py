"""Watches a run under way through its log, in a process of its own; the run knows nothing of it."""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from mcap.records import Attachment, Metadata

from robot_io.errors import EnvironmentFault, LogDamaged
from robot_io.ipc.spawn import spawn
from robot_io.log.log_format import format_of
from robot_io.mcap.files import files_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, RUN_METADATA
from robot_io.mcap.walk import walk
from robot_io.rig.config import RigConfig
from robot_io.rig.logged import rig_of_log
from tools.places.running import RunningRun
from tools.watch.reports import Report, RunEnded, report_link
from tools.watch.run_process import FollowJob

ENDS_WITHIN_S = 1.0
BEGUN_WITHIN_S = 5.0
POLL_S = 0.05


class AttachedRun:
    """The process that follows a run's log; `with` ends it. to_view: where it feeds a live view, if there is one."""

    def __init__(self, run: RunningRun, to_view: socket.socket | None = None) -> None:
        self.reports, far = report_link()
        fds = [far.fileno(), *([to_view.fileno()] if to_view is not None else [])]
        job = FollowJob(run, far.fileno(), os.getpid(), fds[1] if to_view is not None else -1)
        self._child = spawn("run-watch", "tools.watch.run_process", job, fds)
        far.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._child.stop(ENDS_WITHIN_S)
        self._child.close()
        self.reports.close()

    def read(self) -> list[Report]:
        """Return what came since the last call, at last how it ended. Raises PushError where that is unknown."""
        ended = self._child.process.poll() is not None  # looked at first: all that it said is there by then
        told = self.reports.read()
        if ended:
            self._child.hear()
            if self._child.errors:
                raise self._child.errors[0]
            if self._child.finished is None:
                raise EnvironmentFault(f"the process that reads the log {self._child.how_it_ended()}")
            told.append(RunEnded(self._child.finished["text"]))
        return told


def rig_of_run(run: RunningRun) -> RigConfig:
    """Return the rig of a run as its log has it. Raises PushError when the log cannot be read."""
    log, until_s = Path(run.log), time.monotonic() + BEGUN_WITHIN_S
    while True:
        try:
            return _rig_of(files_of(log)[-1])
        except LogDamaged:
            if time.monotonic() > until_s:
                raise
        time.sleep(POLL_S)  # the recorder has not flushed its first bytes yet


def _rig_of(log: Path) -> RigConfig:
    """Read the rig, which stands with its format at the beginning. Raises LogDamaged while that is not all there."""
    config = ""
    for item in walk(log, grown=lambda _: log.stat().st_size):
        if isinstance(item, Attachment) and item.name == CONFIG_ATTACHMENT:
            config = item.data.decode()
        elif isinstance(item, Metadata) and item.name == RUN_METADATA:
            return rig_of_log(config, format_of(item.metadata), str(log)).rig
    raise LogDamaged("there is no config in it", where=str(log))
