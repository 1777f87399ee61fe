"""Follows the log of a run under way: `python -m tools.watch.run_process` (job on stdin).

It reads the file that the recorder writes and nothing else, at low priority, so it cannot disturb the run. The recorder
writes four times a second, so what is shown is up to 0.3 s old; at level sim it writes every second or two.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from collections import deque
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import msgspec
from mcap.records import Message, Metadata

from robot_io.errors import LogDamaged, PushError
from robot_io.ipc.process import die_with_parent
from robot_io.ipc.status import StatusPipe
from robot_io.log.channels import BY_TOPIC
from robot_io.log.log_format import format_of
from robot_io.log.logged_type import LoggedType
from robot_io.mcap.files import files_of, has_parts, part_path
from robot_io.mcap.log_file import RUN_METADATA
from robot_io.mcap.walk import LogItem, Topic, walk
from robot_io.tick import TICK_CDR, ControlTick, FtReading
from tools.live.feed import LiveFeed
from tools.log.derivation import TICK_TOPIC
from tools.places.running import RunningRun
from tools.watch.reports import ReportSender, RunReport

POLL_S = 0.05
NICENESS = 10
MOST_TICKS = 30
"""Of what came at once, this many of the newest ticks are decoded: enough for the mean force that is shown."""
NOT_WHOLE = "the run has ended; its log has no end (`push log recover` may repair it)"


class FollowJob(msgspec.Struct, frozen=True):
    """What to follow."""

    run: RunningRun
    report_fd: int
    parent_pid: int
    live_fd: int = -1
    """Leads to a live view; -1: there is none."""
    status_fd: int = -1


class RunFollower:
    """Reads a log while it grows and reports its newest ticks whenever it has caught up."""

    def __init__(self, run: RunningRun, reports: ReportSender, live: LiveFeed | None) -> None:
        self._run = run
        self._log = self._file = Path(run.log)
        self._reports = reports
        self._live = live
        self._caught_up = False
        self._type: LoggedType[ControlTick] | None = None
        self._payloads: deque[bytes] = deque(maxlen=MOST_TICKS)

    def follow(self) -> str:
        """Follow to the end of the run; return how it ended. Raises PushError when the log cannot be read."""
        channels: dict[int, str] = {}
        log_format = 0
        try:
            for item in chain.from_iterable(self._walk(file) for file in self._files()):
                if isinstance(item, Metadata) and item.name == RUN_METADATA:
                    log_format = format_of(item.metadata)
                elif isinstance(item, Topic):
                    channels[item.channel.id] = item.channel.topic
                    if item.channel.topic == TICK_TOPIC:
                        schema = item.schema
                        self._type = LoggedType(TICK_CDR, schema.name, schema.data.decode(), log_format)
                elif isinstance(item, Message):
                    self._message(channels[item.channel_id], item)
        except LogDamaged:
            if self._run.alive():
                raise
            self._report()
            return NOT_WHOLE
        self._report()
        return f"the run has ended; its log is {self._log}"

    def _files(self) -> Iterator[Path]:
        """Yield the file of the log, or its newest part and those that follow it while the run goes on."""
        number = len(files_of(self._log))
        if not has_parts(self._log):
            yield self._log
            return
        while (file := part_path(self._log, number)).exists():
            yield file
            number += 1
            while self._run.alive() and not part_path(self._log, number).exists():
                time.sleep(POLL_S)

    def _walk(self, file: Path) -> Iterator[LogItem]:
        self._file = file
        return walk(file, grown=self._grown)

    def _message(self, topic: str, message: Message) -> None:
        if topic == TICK_TOPIC:
            self._payloads.append(message.data)
        if self._live is not None and (self._caught_up or BY_TOPIC[topic].latched):
            self._live.add(topic, message.log_time, message.data)

    def _grown(self, wanted: int) -> int:
        while (size := self._file.stat().st_size) < wanted:
            alive = self._run.alive()  # looked at before the size, which no longer changes once they have ended
            size = self._file.stat().st_size
            if size >= wanted or not alive:
                break
            self._report()
            time.sleep(POLL_S)
        return size

    def _report(self) -> None:
        """Report what came since the last time, if there is anything."""
        self._caught_up = True
        if self._live is not None:
            self._live.flush()
        if not self._payloads or self._type is None:
            return
        ticks = [self._type.decode(payload) for payload in self._payloads]
        self._payloads.clear()
        readings: tuple[FtReading, ...] = tuple(reading for tick in ticks for reading in tick.input.ft.readings)
        newest = ticks[-1]
        inp, out = newest.input, newest.output
        self._reports.send(
            RunReport(
                inp.now_ns,
                readings,
                inp.ft.link,
                inp.arm,
                inp.base,
                newest.after.control,
                out.mode,
                inp.paused,
                out.faults,
            )
        )


def main() -> int:
    """Follow until the run has ended or SIGTERM; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=FollowJob)
    die_with_parent(job.parent_pid, signal.SIGTERM)
    os.nice(NICENESS)
    reports = ReportSender(socket.socket(fileno=job.report_fd))
    live = LiveFeed(socket.socket(fileno=job.live_fd)) if job.live_fd >= 0 else None
    status = StatusPipe(job.status_fd)
    try:
        status.say("finished", text=RunFollower(job.run, reports, live).follow())
    except PushError as error:
        status.error(error)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
