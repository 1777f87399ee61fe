"""A loop with an empty tick: the same timer, pacing and real-time set-up as control's, and nothing else.

`python -m tools.bench.clock.bare` is its process: the job on stdin, the result on stdout, both JSON.
"""

from __future__ import annotations

import gc
import subprocess
import sys

import msgspec

from control.pace.pacer import spin_until, wake
from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import EnvironmentFault
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import die_with_parent, fresh_interpreter
from robot_io.ipc.realtime import RealtimeFacts, set_up_realtime
from tools.bench.clock.wakeups import Tick, Wakeups, timed


class BareJob(msgspec.Struct, frozen=True):
    """What the process is to measure."""

    rate_hz: float
    duration_s: float
    priority: int
    cpu: int
    spin_us: float

    @property
    def period_ns(self) -> int:
        """Return the time from deadline to deadline."""
        return round(NS_PER_S / self.rate_hz)


class BareResult(msgspec.Struct, frozen=True):
    """What it found."""

    ticks: list[Tick]
    realtime: RealtimeFacts


class BareLoop:
    """Wakes up on a grid of deadlines, `ticks` times, and notes how late."""

    def __init__(self, period_ns: int, ticks: int, spin_ns: int) -> None:
        self.ticks: list[Tick] = []
        self._skipped = 0
        self._period_ns, self._ticks, self._spin_ns = period_ns, ticks, spin_ns
        self._loop = EventLoop()

    def run(self) -> None:
        """Run to the end."""
        self._sleep_until(monotonic_ns() + self._period_ns)
        self._loop.run()
        self._loop.close()

    def _sleep_until(self, deadline_ns: int) -> None:
        self._loop.call_at(deadline_ns - self._spin_ns, self._on_deadline)

    def _on_deadline(self, woken_ns: int) -> None:
        deadline_ns = woken_ns + self._spin_ns
        paced = wake(deadline_ns, self._period_ns, spin_until(deadline_ns, monotonic_ns))
        self._sleep_until(paced.next_deadline_ns)
        self.ticks.append(Tick(paced.deadline_ns + paced.late_ns, paced.late_ns, paced.skipped))
        self._skipped += paced.skipped
        if len(self.ticks) + self._skipped >= self._ticks:
            self._loop.stop()


def measure(job: BareJob) -> tuple[Wakeups, RealtimeFacts]:
    """Measure in a process of its own. Raises EnvironmentFault when it fails."""
    command, environment = fresh_interpreter("tools.bench.clock.bare")
    done = subprocess.run(
        command, input=msgspec.json.encode(job), env=environment, capture_output=True,
        timeout=job.duration_s + 30.0, check=False,
    )  # fmt: skip
    if done.returncode:
        raise EnvironmentFault(
            f"the bare loop failed: {done.stderr.decode(errors='replace').strip()[-200:]}", where="push bench loop"
        )
    found = msgspec.json.decode(done.stdout, type=BareResult)
    skipped = sum(tick.skipped for tick in found.ticks)
    return timed(found.ticks, job.period_ns, skipped, {}), found.realtime


def main() -> int:
    """Measure as the job says and print the result."""
    die_with_parent()
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=BareJob)
    got = set_up_realtime(job.priority, cpu=job.cpu, spin_us=job.spin_us)
    loop = BareLoop(job.period_ns, round(job.duration_s * job.rate_hz), round(got.spin_us * 1e3))
    gc.collect()
    gc.freeze()
    gc.disable()
    loop.run()
    sys.stdout.buffer.write(msgspec.json.encode(BareResult(loop.ticks, got)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
