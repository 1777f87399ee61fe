"""`push bench latency`: from a step of the force at the emulated sensor to the changed command at the emulated base.

A hand presses on the ball again and again while a whole run pushes at level emulated; what happened when is in its log.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from robot_io.clock import NS_PER_MS, NS_PER_S
from robot_io.error_report import say_json, tell
from robot_io.errors import EnvironmentFault
from robot_io.log.world_messages import COMMAND_CDR, START_CDR, WorldCommand
from robot_io.mcap.read import read_log
from robot_io.tick import TICK_CDR, ControlTick, FtReading
from tools.terminal.arguments import whole_number

PRESS_N = 8.0
"""Across the push: half of what the object pushes back with."""
NOISE_N = 0.1
STEP_N = 4.0
"""Half a press, and twenty times what noise makes of the difference of two packets."""
FIRST_S, EVERY_S, FOR_S = 7.0, 0.47, 0.2
"""After start, tare and approach; no whole number of periods, so that presses come at any time of a tick."""
LATEST_NS = 100 * NS_PER_MS
STAGES = {
    "sensor_us": "from the press to its first packet: the sensor's next sample, its line, the driver",
    "median_us": "to the next packet, for which the median of three waits",
    "tick_us": "to the deadline of the next tick",
    "slot_us": "to the tick whose command the gate may send: it sends every other one",
    "command_us": "from that deadline until the command leaves the gate: wake-up, law, safety, envelope, gate",
    "wire_us": "until it is at the base: bridge and its socket",
    "total_us": "all of it",
    "software_us": "command and wire together: all but the line and what waits for a time",
}
PUSH = "import sys; from robot_io._entry import main; sys.exit(main())"
START_S = 60.0


class Step(NamedTuple):
    """One step of the force and its way to the base: when each stage ended, CLOCK_MONOTONIC in ns."""

    pressed_ns: int
    first_ns: int
    second_ns: int
    tick_ns: int
    slot_ns: int
    sent_ns: int
    arrived_ns: int

    def stages(self) -> dict[str, float]:
        """Return how long each of `STAGES` took, us."""
        spans = [1e-3 * (after - before) for before, after in pairwise(self)]
        return dict(zip(STAGES, [*spans, sum(spans), spans[-2] + spans[-1]], strict=True))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    steps = "steps of the force, 0.2 s or more apart (60)"
    parser.add_argument("--steps", type=whole_number(2, 500), metavar="N", default=60, help=steps)
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Push, measure and print the figures; return the exit code. Raises EnvironmentFault."""
    steps = measure(args.steps)
    figures = summed_up([step.stages() for step in steps])
    tell(f"{len(steps)} of {args.steps} steps reached the base; us, median and 99th percentile:")
    for name, (p50, p99) in figures.items():
        tell(f"{name.removesuffix('_us'):9s} {p50:8.0f} {p99:8.0f}   {STAGES[name]}")
    if args.json:
        found = {name: {"p50": round(p50, 1), "p99": round(p99, 1)} for name, (p50, p99) in figures.items()}
        say_json({"schema": 1, "steps": len(steps), "asked": args.steps, "stages": found})
    return 0


def summed_up(found: Sequence[dict[str, float]]) -> dict[str, tuple[float, float]]:
    """Return median and 99th percentile of each stage."""
    at = 99 * len(found) // 100
    columns = {name: sorted(one[name] for one in found) for name in STAGES}
    return {name: (statistics.median(column), column[at]) for name, column in columns.items()}


def measure(steps: int) -> list[Step]:
    """Run a push with so many steps of the force and return those that can be followed. Raises EnvironmentFault."""
    presses: list[dict[str, Any]] = [
        {"at_s": round(FIRST_S + i * EVERY_S, 3), "for_s": FOR_S, "force_body_N": [0.0, (-1.0) ** i * PRESS_N, 0.0]}
        for i in range((steps + 1) // 2)
    ]
    pushing_s = presses[-1]["at_s"] + 1.0 - FIRST_S + 2.0
    settings = {
        "world.hand": _toml(presses),
        "world.sensor.noise_force_N": NOISE_N,
        "ft.tare_s": 1.0,
        "control.distance_m": round(0.1 * pushing_s, 2),
        "control.push_speed_m_per_s": 0.1,
    }
    with tempfile.TemporaryDirectory(prefix="push-bench-") as folder:
        out = Path(folder) / "run"
        words = ["run", "emulated", "--no-report", "--out", str(out), *(f"--set={k}={v}" for k, v in settings.items())]
        done = subprocess.run(
            [sys.executable, "-c", PUSH, *words],
            cwd=Path(__file__).resolve().parents[2],
            env=os.environ | {"XDG_STATE_HOME": folder},  # the user's saved tare is not changed
            stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=pushing_s + START_S, check=False,
        )  # fmt: skip
        try:
            input_us = json.loads((out / "summary.json").read_text())["loop"]["stages_us"]["input"]
            found = _read(out / "run.mcap", presses, round(1e3 * input_us))[:steps]
        except (OSError, KeyError):
            found = []
    if not found:
        raise EnvironmentFault(f"the run failed: {done.stderr.strip()[-300:]}", where="push bench latency")
    return found


def _toml(presses: list[dict[str, Any]]) -> str:
    rows = (", ".join(f"{key} = {value!r}" for key, value in press.items()) for press in presses)
    return f"[{', '.join('{' + row + '}' for row in rows)}]"


def _read(log: Path, presses: list[dict[str, Any]], input_ns: int) -> list[Step]:
    ticks: list[ControlTick] = []
    arrivals: list[WorldCommand] = []
    start_ns = 0
    for message in read_log(log):
        if message.topic == "/control/tick":
            ticks.append(TICK_CDR.decode(message.payload))
        elif message.topic == "/world/command":
            arrivals.append(COMMAND_CDR.decode(message.payload))
        elif message.topic == "/world/start":
            start_ns = START_CDR.decode(message.payload).start_ns
    edges = [start_ns + round(s * NS_PER_S) for p in presses for s in (p["at_s"], p["at_s"] + p["for_s"])]
    followed = (follow(edge, ticks, arrivals, input_ns) for edge in edges)
    return [step for step in followed if step is not None]


def follow(
    pressed_ns: int, ticks: Sequence[ControlTick], arrivals: Iterable[WorldCommand], input_ns: int
) -> Step | None:
    """Return the way of the step of the force at `pressed_ns`; None where it cannot be followed.

    input_ns: how long a tick takes to read its input, between its waking and the time that it is stamped with.
    """
    near = [tick for tick in ticks if pressed_ns - LATEST_NS < tick.input.now_ns < pressed_ns + LATEST_NS]
    readings = [(reading, at) for at, tick in enumerate(near) for reading in tick.input.ft.readings]
    first = _first_of_step(pressed_ns, [reading for reading, _ in readings])
    if first is None or first + 1 >= len(readings):
        return None
    second, at = readings[first + 1]
    # What the gate has sent is in the input of the ticks after it.
    sent = next((i for i in range(at + 1, len(near)) if near[i].input.base.sent_ns > near[at].input.now_ns), None)
    if sent is None:
        return None
    base = near[sent].input.base
    slot = next((i for i in range(sent - 1, at - 1, -1) if near[i].output.command_body == base.sent), None)
    arrived = next((c.arrival_ns for c in arrivals if c.arrival_ns >= base.sent_ns and c.twist == base.sent), None)
    if slot is None or arrived is None:
        return None

    def deadline_ns(tick: ControlTick) -> int:
        return tick.input.now_ns - tick.input.host.late_ns - input_ns

    return Step(
        pressed_ns,
        readings[first][0].received_ns,
        second.received_ns,
        max(deadline_ns(near[at]), second.received_ns),
        max(deadline_ns(near[slot]), second.received_ns),
        base.sent_ns,
        arrived,
    )


def _first_of_step(pressed_ns: int, readings: Sequence[FtReading]) -> int | None:
    """Return which reading is the first with another force, of those that came after the press."""
    for i in range(1, len(readings)):
        before, after = readings[i - 1], readings[i]
        if after.received_ns >= pressed_ns and math.dist(before.force, after.force) > STEP_N:
            return i
    return None
