"""`push bench sim`: how much faster than real time level `sim` runs as a process, and where a tick's time goes.

The figures hold for this machine at this moment; only the ratios within one run can be compared.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.error_report import say_json, tell
from robot_io.errors import EnvironmentFault
from robot_io.mcap.read import read_summary
from robot_io.rig.config import rig_to_toml
from robot_io.tick import TICK_CDR, ControlTick, TickState
from tools.log.tick_topics import TickTopics
from tools.rig import resolve_rig
from tools.run.lockstep import Lockstep, open_log
from tools.run.tick_core import TickCore
from tools.terminal.arguments import number

ROUNDS = 5
"""The best of this many rounds counts."""
PARTS_DISTANCE_M = 1.0
PROCESS_TIMEOUT_S = 600.0
PUSH = "import sys; from robot_io._entry import main; sys.exit(main())"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "--distance-m", type=number(0.1, 100), metavar="M", default=6.0, help="length of the push that is timed (6)"
    )
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Measure and print the figures; return the exit code. Raises EnvironmentFault."""
    with tempfile.TemporaryDirectory(prefix="push-bench-") as folder:
        figures = time_process(Path(folder), args.distance_m) | time_tick_parts(Path(folder))
    figures = {key: float(f"{value:.4g}") for key, value in figures.items()}
    for key, value in figures.items():
        tell(f"{key:28s} {value:g}")
    if args.json:
        say_json({"schema": 1, **figures})
    return 0


def time_process(folder: Path, distance_m: float) -> dict[str, float]:
    """Time `push run sim --fast` including its start and its log, without a report: processor and wall time in s."""
    environment = os.environ | {"XDG_STATE_HOME": str(folder)}  # the user's saved tare is not changed
    best_cpu_s = best_wall_s = float("inf")
    for n in range(ROUNDS):
        out = folder / f"run{n}"
        words = ["run", "sim", "--fast", "--no-report", "--distance-m", str(distance_m), "--out", str(out)]
        before, began_s = _children_s(), time.monotonic()
        done = subprocess.run(
            [sys.executable, "-c", PUSH, *words],
            cwd=Path(__file__).resolve().parents[2], env=environment, capture_output=True, text=True,
            timeout=PROCESS_TIMEOUT_S, check=False,
        )  # fmt: skip
        best_wall_s = min(best_wall_s, time.monotonic() - began_s)
        best_cpu_s = min(best_cpu_s, _children_s() - before)
        if done.returncode:
            raise EnvironmentFault(f"the push failed: {done.stderr.strip()[-200:]}", where="push bench sim")
    log = read_summary(out / "run.mcap")
    simulated_s = (log.end_ns - log.start_ns) / NS_PER_S
    return {
        "simulated_s": simulated_s,
        "process_cpu_s": best_cpu_s,
        "process_wall_s": best_wall_s,
        "times_real_time_by_cpu": simulated_s / best_cpu_s,
        "times_real_time_by_wall": simulated_s / best_wall_s,
    }


class RecordedRun:
    """The records of a lockstep run in memory, to be written again."""

    def __init__(self) -> None:
        self.records: list[tuple[int, int, bytes]] = []
        self.ticks: list[tuple[int, bytes, ControlTick]] = []

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        """Keep one ring record."""
        self.records.append((kind, time_ns, payload))

    def tick(self, time_ns: int, payload: bytes, tick: ControlTick | None) -> None:
        """Keep one tick."""
        assert tick is not None
        self.ticks.append((time_ns, payload, tick))


def time_tick_parts(folder: Path) -> dict[str, float]:
    """Time the parts of a tick over the same recorded push, in ns per tick."""
    rig = resolve_rig("sim", [f"control.distance_m={PARTS_DISTANCE_M!r}"])
    text = rig_to_toml(rig)
    core = TickCore.of(rig)
    kept = RecordedRun()
    Lockstep(rig, 0, kept).run(lambda *_: None)
    ticks = [tick for _, _, tick in kept.ticks]

    def simulate() -> None:
        Lockstep(rig, 0, RecordedRun()).run(lambda *_: None)

    def without_log() -> None:
        Lockstep(rig, 0, None, compiled=True).run(lambda *_: None)

    def fold() -> None:
        state = TickState()
        for tick in ticks:
            state, _ = core.fold(state, tick.input)

    def encode() -> None:
        for tick in ticks:
            TICK_CDR.encode(tick)

    def derive() -> None:
        topics = TickTopics(rig, 0)
        for tick in ticks:
            topics.expand(tick)

    def derive_and_write() -> None:
        path = folder / "parts.mcap"
        path.unlink(missing_ok=True)
        log = open_log(path, text, 0, in_contact=False)
        for kind, time_ns, payload in kept.records:
            log.record(kind, time_ns, payload)
        for time_ns, payload, tick in kept.ticks:
            log.tick(time_ns, payload, tick)
        log.finish({})

    figures = {"ticks": float(len(ticks))}
    for name, part in (("fold", fold), ("encode", encode), ("derive", derive)):
        figures[f"{name}_ns_per_tick"] = _best_ns(part) / len(ticks)
    # What remains without deriving: checksums, indexes, compression, the file.
    figures["write_ns_per_tick"] = _best_ns(derive_and_write) / len(ticks) - figures["derive_ns_per_tick"]
    # The complete tick without its log: devices, world, gate, fold and the encoding of every record.
    figures["simulate_ns_per_tick"] = _best_ns(simulate) / len(ticks)
    # The same without any record, as `push study` runs it.
    figures["without_log_ns_per_tick"] = _best_ns(without_log) / len(ticks)
    figures["times_real_time_without_log"] = NS_PER_S / rig.loop.rate_hz / figures["without_log_ns_per_tick"]
    return figures


def _best_ns(part: Callable[[], Any]) -> float:
    best = float("inf")
    for _ in range(ROUNDS):
        began = time.process_time_ns()
        part()
        best = min(best, time.process_time_ns() - began)
    return best


def _children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
