"""A complete run at level emulated: drivers, emulators, gate, recorder and all; its loop's wake-ups from its log."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from robot_io.clock import NS_PER_S
from robot_io.errors import EnvironmentFault
from robot_io.ipc.realtime import NO_CPU
from robot_io.mcap.read import read_log
from robot_io.tick import TICK_CDR
from tools.bench.clock.wakeups import Tick, Wakeups, timed

TARE_S = 1.0
STANDING_S = 6.0
"""About what a push takes beside its way: start, tare, approach, retreat and check."""
SPEED_M_PER_S = 0.1
LEAST_M = 0.1
PUSH = "import sys; from robot_io._entry import main; sys.exit(main())"


def measure(rate_hz: float, duration_s: float, spin_us: float, cpu: int = NO_CPU) -> Wakeups:
    """Push for about `duration_s` and return the wake-ups of the loop. Raises EnvironmentFault without a log."""
    distance_m = max(LEAST_M, (duration_s - STANDING_S) * SPEED_M_PER_S)
    settings = {
        "loop.rate_hz": rate_hz,
        "loop.spin_us": spin_us,
        "loop.cpu": cpu,
        "ft.tare_s": TARE_S,
        "control.push_speed_m_per_s": SPEED_M_PER_S,
    }
    with tempfile.TemporaryDirectory(prefix="push-bench-") as folder:
        out = Path(folder) / "run"
        words = ["run", "emulated", "--no-report", "--distance-m", repr(distance_m), "--out", str(out)]
        words += [f"--set={key}={value!r}" for key, value in settings.items()]
        done = subprocess.run(
            [sys.executable, "-c", PUSH, *words],
            cwd=Path(__file__).resolve().parents[3],
            env=os.environ | {"XDG_STATE_HOME": folder},  # the user's saved tare is not changed
            stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=duration_s + 120.0, check=False,
        )  # fmt: skip
        return _read(out, done.stderr, round(NS_PER_S / rate_hz))


def _read(out: Path, stderr: str, period_ns: int) -> Wakeups:
    """Return the wake-ups of a run. A run that its safety ended is as good as any: its loop ran."""
    try:
        loop = json.loads((out / "summary.json").read_text())["loop"]
        ticks = [_tick(message.payload) for message in read_log(out / "run.mcap") if message.topic == "/control/tick"]
    except (OSError, KeyError):
        ticks, loop = [], {}
    if not ticks:
        raise EnvironmentFault(f"the run failed: {stderr.strip()[-300:]}", where="push bench loop")
    return timed(ticks, period_ns, int(loop["skipped"]), loop)


def _tick(payload: bytes) -> Tick:
    """Return when a tick woke up. `now_ns` is a little later (the devices are read first), on the run's own clock."""
    inp = TICK_CDR.decode(payload).input
    return Tick(inp.now_ns, inp.host.late_ns, inp.host.skipped)
