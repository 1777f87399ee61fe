"""cyclictest (package rt-tests), the kernel's own measure of a wake-up, at the loop's period and priority."""

from __future__ import annotations

import re
import shutil
import subprocess

from robot_io.errors import EnvironmentFault
from robot_io.ipc.realtime import NO_CPU
from tools.bench.clock.wakeups import Wakeups

HISTOGRAM_US = 20_000
"""Later wake-ups are counted as this late."""
_LINE = re.compile(r"^(\d{6}) (\d+)$", re.MULTILINE)
_OVERFLOWS = re.compile(r"^# Histogram Overflows: (\d+)", re.MULTILINE)


def has_cyclictest() -> bool:
    """Return whether the program is installed."""
    return shutil.which("cyclictest") is not None


def measure(rate_hz: float, duration_s: float, priority: int, cpu: int = NO_CPU) -> Wakeups:
    """Run it for `duration_s` and return its wake-ups, in whole us. Raises EnvironmentFault when it fails."""
    command = [
        "cyclictest", "-q", "-m", "-t", "1", "-p", str(priority), "-i", str(round(1e6 / rate_hz)),
        "-D", str(max(1, round(duration_s))), "-h", str(HISTOGRAM_US),
    ]  # fmt: skip
    if cpu != NO_CPU:
        command += ["-a", str(cpu)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=duration_s + 30.0, check=False)
    if done.returncode:
        raise EnvironmentFault(
            f"cyclictest failed: {(done.stderr or done.stdout).strip()[-200:]}",
            where="push bench loop",
            do="Allow real-time priority (docs/realtime.md)",
        )
    return read_histogram(done.stdout)


def read_histogram(text: str) -> Wakeups:
    """Return the wake-ups of the histogram that `-h` prints. Raises EnvironmentFault if there are none in it."""
    late: list[float] = []
    for us, count in _LINE.findall(text):
        late += [float(us)] * int(count)
    beyond = _OVERFLOWS.search(text)
    late += [float(HISTOGRAM_US)] * (int(beyond[1]) if beyond else 0)
    if not late:
        raise EnvironmentFault("cyclictest printed no histogram", where="push bench loop")
    return Wakeups(tuple(late))
