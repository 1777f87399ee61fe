"""The recorder process: drains the rings of a run into its log and finishes the log when control has ended.

    python -m tools.run.recorder  < one line of JSON: {
        "out_path": "DIR/run.mcap", "config_text": "...", "metadata": {"seed": "0"}, "wall_offset_ns": N,
        "rings": [{"name": "control", "fd": 5}, {"name": "gate", "fd": 6}, {"name": "world", "fd": 7}],
        "alive_fds": [8, 9, 10], "status_fd": 11, "live_fd": 12}

`alive_fds` are read ends of pipes, one for each ring and in the same order; only the producer holds the write end, so
EOF means it has ended. The first is control's: its EOF ends the run. The others then have 1.5 s to end.
`live_fd` leads to the live view, -1 where there is none; nothing waits for it.

There is no other way to stop it: SIGINT, SIGTERM and SIGHUP are ignored, because a signal to the process group
would truncate the log. What is written is handed to the system four times a second and brought to the disk every
second. On `status_fd` it reports "ready", "error" and "finished" (`robot_io.ipc.status`).
If the disk fails, it reports the error, keeps draining so that no producer blocks, and counts the lost records; exit
code 1.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec

from robot_io.clock import NS_PER_MS, monotonic_ns, wall_offset_ns
from robot_io.errors import EnvironmentFault, LogDamaged, PushError
from robot_io.ipc.event_loop import HANGUP, READ, EventLoop
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from tools.live.feed import LiveFeed
from tools.log.run_parts import RunParts

POLL_NS = 20 * NS_PER_MS
FLUSH_NS = 250 * NS_PER_MS
SYNC_NS = 1000 * NS_PER_MS
"""How often the file is brought to the disk. A disk that takes longer than that holds the push (F63)."""
OTHERS_MAX_NS = 1500 * NS_PER_MS
FINAL_DRAIN_MAX_NS = 5000 * NS_PER_MS
"""Limit for a producer that is still running and pushes faster than the disk can write."""
_BATCH = 1000


class RingSource(msgspec.Struct, frozen=True):
    """A ring to drain: its name in the log's metadata and its memfd."""

    name: str
    fd: int


class Job(msgspec.Struct, frozen=True):
    """What to record; see the module docstring."""

    out_path: str
    config_text: str
    metadata: dict[str, str]
    wall_offset_ns: int
    rings: list[RingSource]
    alive_fds: list[int]
    status_fd: int
    live_fd: int = -1


class Recorder:
    """Drains rings into one log until every producer has ended."""

    def __init__(self, job: Job, status: StatusPipe) -> None:
        self._job = job
        self._status = status
        self._rings = {source.name: Ring(source.fd) for source in job.rings}
        self._counts = dict.fromkeys(self._rings, 0)
        self._alive = set(job.alive_fds)
        self._lost = 0
        self._disk_failed = False
        self._control_gone_ns: int | None = None
        self._loop = EventLoop()
        self._live = LiveFeed(socket.socket(fileno=job.live_fd)) if job.live_fd >= 0 else None
        self._caught_up = True
        self._log = RunParts(
            Path(job.out_path),
            config_text=job.config_text,
            metadata=job.metadata,
            wall_offset_ns=job.wall_offset_ns,
            also=self._live.add if self._live is not None else None,
        )

    def run(self) -> int:
        """Record until the end of the run; return the exit code."""
        for fd in self._job.alive_fds:
            self._loop.add_fd(fd, partial(self._on_alive, fd), READ | HANGUP)
        self._loop.call_every(POLL_NS, self._on_poll)
        self._loop.call_every(FLUSH_NS, lambda _: self._to_disk(self._log.flush))
        self._loop.call_every(SYNC_NS, lambda _: self._to_disk(lambda: os.fdatasync(self._log.fileno())))
        self._status.say("ready", path=self._job.out_path)
        self._loop.run()
        until_ns = monotonic_ns() + FINAL_DRAIN_MAX_NS
        while self._drain() and monotonic_ns() < until_ns:  # records pushed while the last producer ended
            continue
        self._finish()
        self._loop.close()
        return 1 if self._disk_failed else 0

    def _on_alive(self, fd: int, _: int) -> None:
        if os.read(fd, 4096):
            return
        self._loop.remove_fd(fd)
        self._alive.discard(fd)
        if fd == self._job.alive_fds[0]:
            self._control_gone_ns = monotonic_ns()
        self._end_when_due()

    def _on_poll(self, _: int) -> None:
        self._drain()
        if self._caught_up:  # no tick is written before a record that it holds
            self._to_disk(lambda: self._log.cut(monotonic_ns()))
        self._end_when_due()

    def _end_when_due(self) -> None:
        gone_ns = self._control_gone_ns
        if gone_ns is not None and (not self._alive or monotonic_ns() - gone_ns >= OTHERS_MAX_NS):
            self._loop.stop()

    def _drain(self) -> bool:
        """Write what is in the rings, a bounded part at a time; return whether there was anything."""
        found, self._caught_up = False, True
        for name, ring in self._rings.items():
            try:
                records = ring.pop_all(_BATCH)
            except LogDamaged as damage:
                self._status.error(LogDamaged(damage.what, where=f"the ring of {name}"))
                continue
            found = found or bool(records)
            self._caught_up = self._caught_up and len(records) < _BATCH
            self._counts[name] += len(records)
            for kind, time_ns, payload in records:
                self._write(kind, time_ns, payload)
        if self._live is not None:
            self._live.flush()
        return found

    def _write(self, kind: int, time_ns: int, payload: bytes) -> None:
        if self._disk_failed:
            self._lost += 1
            return
        self._to_disk(lambda: self._log.record(kind, time_ns, payload))

    def _to_disk(self, act: Callable[[], None]) -> None:
        if not self._disk_failed:
            try:
                act()
            except OSError as error:
                self._disk_error(error)

    def _disk_error(self, error: OSError) -> None:
        self._disk_failed = True
        self._log.abandon()
        what = f"the log cannot be written any more: {error.strerror}"
        self._status.error(EnvironmentFault(what, where=self._job.out_path, do="Free some space on that disk"))

    def _finish(self) -> None:
        dropped = {name: ring.dropped for name, ring in self._rings.items()}
        facts = {f"records_{name}": str(count) for name, count in self._counts.items()}
        facts |= {f"dropped_{name}": str(count) for name, count in dropped.items()}
        facts["wall_offset_ns_at_end"] = str(wall_offset_ns())
        self._to_disk(lambda: self._log.finish(facts))
        self._status.say(
            "finished",
            complete=not self._disk_failed,
            messages=self._log.messages,
            ticks=self._log.ticks,
            records=self._counts,
            dropped=dropped,
            lost=self._lost,
            undecodable=self._log.undecodable,
            object_poses=self._log.object_poses,
            live=self._live.counts() if self._live is not None else None,
            latencies=self._log.latencies,
        )


def main() -> int:
    """Read the job from stdin and record; return the exit code."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=Job)
    status = StatusPipe(job.status_fd)
    try:
        recorder = Recorder(job, status)
    except PushError as error:
        status.error(error)
        return error.exit_code
    return recorder.run()


if __name__ == "__main__":
    sys.exit(main())
