"""A scenario on the wire: the processes of a real run against the emulators, measured where the commands arrive."""

from __future__ import annotations

import contextlib
import json
import math
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from robot_io.ipc.process import fresh_interpreter
from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.messages import INJECTED, SAFETY_EVENT
from robot_io.log.world_messages import COMMAND_CDR
from robot_io.mcap.log_file import RUN_METADATA
from robot_io.mcap.read import read_log, read_summary
from robot_io.tick import TICK_CDR, ControlTick
from tools.faults.lockstep_round import NOT_ENDED, PERIOD_NS, LockstepRound, Seen, moment_tick, size
from tools.faults.scenario import Scenario, at
from tools.log.derivation import TICK_TOPIC
from tools.log.run_log import OFFSET_FACT

SENT, ARRIVED, EVENTS = CHANNELS[Kind.GATE_SENT], CHANNELS[Kind.WORLD_COMMAND], CHANNELS[Kind.SAFETY_EVENT]
PUSH = "import sys; from robot_io._entry import main; sys.exit(main())"
SETTINGS = (
    "control.distance_m=1.0",
    *("ft.tare_s=0.3", "control.approach_speed_m_per_s=0.1", "control.ramp_s=0.3", "control.retreat_m=0.0"),
)
"""Less waiting around the push."""
LATER_S = 0.3
"""Real devices settle a little later than simulated ones."""
MOST_S = 30.0
"""A run that lasts longer is held by a fault that lasts, and is stopped."""
EVERY_S = 0.02
"""How often the processes are looked at."""
SEEN_WITHIN_NS = 2_000_000
"""A tick may still see what arrived this long after it began."""
SPAN_NS = 200_000_000
WATCHED = ("control", "gate", "arm", "emulators")


class Waited(NamedTuple):
    """How long a process of the run has waited for a processor in all, by `at_ns` (CLOCK_MONOTONIC)."""

    at_ns: int
    name: str
    ms: float


class WireRound(NamedTuple):
    """What came of a round; the `speed` of a tick is that of the newest command that had come to the base by then."""

    seen: LockstepRound
    bad_ns: int | None
    """When the first tick began that could see the fault, CLOCK_MONOTONIC; None where it changed nothing."""
    waited: list[Waited]
    said: str
    """The last line on stderr."""

    def stall_ms(self, within_ns: int) -> float:
        """Return the longest that one process waited for a processor about the fault, up to `within_ns` after it.

        Of a run that ended before its fault, within any 0.2 s.
        """
        if self.bad_ns is None:
            return _longest_ms(self.waited, SPAN_NS)
        since, until = self.bad_ns - SPAN_NS, self.bad_ns + within_ns + SPAN_NS
        return _longest_ms([one for one in self.waited if since <= one.at_ns <= until], until - since)


def run_on_wire(scenario: Scenario) -> WireRound:
    """Run a scenario at level emulated, to its end."""
    moment_s = moment_tick(scenario.moment, SETTINGS, 0) * PERIOD_NS * 1e-9 + LATER_S
    words = at(scenario.words, moment_s)
    with tempfile.TemporaryDirectory(prefix="push-faults-") as folder:
        out = Path(folder) / "run"
        argv = ["run", "emulated", "--no-report", "--json", "--out", str(out)]
        argv += [part for word in words for part in ("--fault", word)]
        argv += [part for setting in SETTINGS for part in ("--set", setting)]
        code, waited, said = _watched(argv, out, Path(folder))
        log = out / "run.mcap"
        ticks, bad, bad_ns = _seen(log, scenario) if log.exists() else ([], None, None)
    return WireRound(LockstepRound(ticks, bad, code), bad_ns, waited, said)


def _watched(argv: list[str], out: Path, folder: Path) -> tuple[int, list[Waited], str]:
    """Run `push` with `argv`; return its exit code, how its processes waited, and its last line on stderr."""
    waited: list[Waited] = []
    said = folder / "said"
    [interpreter, own_path_only, *_], environment = fresh_interpreter("")
    with said.open("wb") as err:
        process = subprocess.Popen(
            [interpreter, own_path_only, "-c", PUSH, *argv],
            env=environment | {"XDG_STATE_HOME": str(folder / "state")},  # the user's saved tares stay as they are
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=err,
            start_new_session=True,
        )
        try:
            until_s = time.monotonic() + MOST_S
            while (ended := process.poll()) is None and time.monotonic() < until_s:
                waited += _waited(out / "processes.json")
                time.sleep(EVERY_S)
        finally:
            process.terminate()  # as the operator's stop; it has no effect on one that has ended
            process.wait()
    code = NOT_ENDED if ended is None else ended
    lines = said.read_text(errors="replace").splitlines()
    return code, waited, lines[-1] if lines else ""


def _waited(processes: Path) -> Iterator[Waited]:
    """Yield how long each watched process has waited until now; nothing before they are there."""
    with contextlib.suppress(OSError, ValueError):
        pids = json.loads(processes.read_text())
        now_ns = time.monotonic_ns()
        for name in WATCHED:
            with contextlib.suppress(OSError, KeyError, IndexError):
                ms = int(Path(f"/proc/{pids[name]}/schedstat").read_text().split()[1]) / 1e6
                yield Waited(now_ns, name, ms)


def _longest_ms(waited: list[Waited], span_ns: int) -> float:
    """Return the longest that one process waited for a processor within `span_ns`."""
    longest = 0.0
    for name in WATCHED:
        mine, first = [one for one in waited if one.name == name], 0
        for one in mine:
            while one.at_ns - mine[first].at_ns > span_ns:
                first += 1
            longest = max(longest, one.ms - mine[first].ms)
    return longest


def _seen(log: Path, scenario: Scenario) -> tuple[list[Seen], int | None, int | None]:
    """Return what the ticks came to, the first of them that could see the injected fault, and when that one began."""
    offset_ns = int(read_summary(log).metadata[RUN_METADATA][OFFSET_FACT])
    # What arrives at a base that does not obey says nothing: then what the gate sent counts.
    spoilt = any(word.startswith("base.command.") for word in scenario.words)
    ticks: list[ControlTick] = []
    commands: list[tuple[int, float]] = []
    injected_ns: int | None = None
    for message in read_log(log):
        at_ns = message.log_time_ns - offset_ns
        if message.topic == TICK_TOPIC:
            ticks.append(TICK_CDR.decode(message.payload))
        elif message.topic == SENT.topic and spoilt:
            twist = SENT.cdr_type.decode(message.payload).twist.linear
            commands.append((at_ns, math.hypot(twist.x, twist.y)))
        elif message.topic == ARRIVED.topic and not spoilt:
            command = COMMAND_CDR.decode(message.payload)
            if not command.is_switch:
                commands.append((command.arrival_ns, size(command.twist)))
        elif message.topic == EVENTS.topic and SAFETY_EVENT.decode(message.payload).kind == INJECTED:
            injected_ns = at_ns if injected_ns is None else min(at_ns, injected_ns)
    bad = _first_bad(ticks, injected_ns)
    return _as_seen(ticks, sorted(commands), scenario), bad, None if bad is None else ticks[bad].input.now_ns


def _as_seen(ticks: list[ControlTick], commands: list[tuple[int, float]], scenario: Scenario) -> list[Seen]:
    seen, at, speed = [], 0, 0.0
    for tick in ticks:
        inp, after, output = tick.input, tick.after, tick.output
        while at < len(commands) and commands[at][0] <= inp.now_ns:
            speed = commands[at][1]
            at += 1
        begun = scenario.begins is None or scenario.begins(inp, after)
        seen.append(Seen(after.control.phase, speed, output.mode, output.faults, inp.base.pose.y, begun))
    return seen


def _first_bad(ticks: list[ControlTick], injected_ns: int | None) -> int | None:
    if injected_ns is None:
        return None
    return next((i for i, tick in enumerate(ticks) if tick.input.now_ns + SEEN_WITHIN_NS >= injected_ns), None)
