"""Kills and freezes drawn from a seed: any process of a run or all of them, any signal, any phase.

What must hold of every round, whatever the host does: the run ends, nothing of it stays alive, its words are no
traceback, and its code is 0 only where its log proves the push. Times and ways are judged where the host kept still.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any, NamedTuple

from robot_io.errors import PushError
from robot_io.log.world_messages import STATE_CDR
from robot_io.mcap.read import read_log
from robot_io.tick import TICK_CDR, Phase
from tests.faults.kill_rounds import STALL_MS
from tests.host_watch import HostWatch
from tests.push_runs import PUSH, ROOT, Ended, Run, blame_the_host, stands, started, world_of

NAMES = ("control", "gate", "arm", "recorder", "emulators", "launcher")
KILL, STOP, SEGV = signal.SIGKILL, signal.SIGSTOP, signal.SIGSEGV
PHASES = {
    "opening": "",
    "tare": "TARE ",
    "approach": "APPROACH ",
    "push": r"PUSH +(?!0\.00/)[0-9.]+/",
    "retreat": "RETREAT |CHECK ",
}
"""What the run says in each phase, once a second."""
LONG_PHASES = (
    *("ft.tare_s=1.2", "control.approach_speed_m_per_s=0.1", "control.ramp_s=0.3", "control.retreat_m=0.15"),
    *("world.start.gap_m=0.15", "path.expected_contact_m=0.15"),
)
ENDS_WITHIN_S = 45.0
"""A device that never answers is given up after 20 s, and so is each of those behind it."""
GONE_WITHIN_S, RECORDER_S = 5.0, 5.0
"""Nobody is left this long after rest, and the recorder may finish its file first."""
WAY_M = {
    ("control", KILL): 0.008, ("control", SEGV): 0.008, ("control", STOP): 0.013,
    ("launcher", KILL): 0.008, ("launcher", SEGV): 0.008, ("launcher", STOP): 0.075,
    ("gate", KILL): 0.033, ("gate", SEGV): 0.033, ("gate", STOP): 0.033,
    ("arm", KILL): 0.009, ("arm", SEGV): 0.009, ("arm", STOP): 0.018,
    ("recorder", KILL): 0.130, ("recorder", SEGV): 0.130, ("recorder", STOP): 0.130,
}  # fmt: skip
"""At 0.1 m/s: zero within 20 ms (70 ms frozen), rest 60 ms later; the base's own timeout and its ticks, 330 ms; 30 ms
for the arm's end, its silence of 100 ms; a hold after 0.5 s of a silent launcher, after 1 s without a recorder."""


class Blow(NamedTuple):
    """Who is struck with what, in which phase, and how long after the run says so; frozen ones wake after `wake_s`."""

    name: str
    who: tuple[str, ...]
    number: signal.Signals
    phase: str
    later_s: float
    wake_s: float


class Found(NamedTuple):
    """What came of a blow: ms and m after it, None where it cannot be seen in what is left of the log."""

    blow: Blow
    code: int
    verdict: str
    phase: str
    """The phase in which it really struck; "" where no tick tells."""
    zero_ms: float | None
    rest_ms: float | None
    way_m: float | None
    gone_s: float
    """When nobody was left but who was frozen."""
    stall_ms: float


def drawn_blow(seed: int, number: int) -> Blow:
    """Return the blow of a round: who, signal and phase in turn, so that all are tried; the rest is drawn."""
    draw = random.Random(f"{seed}/{number}")
    names = (*NAMES, "all")
    order = random.Random(seed).sample(range(len(names) * 3 * len(PHASES)), len(names) * 3 * len(PHASES))
    turn = order[number % len(order)]
    name = names[turn % len(names)]
    signal_number = (KILL, STOP, SEGV)[turn // len(names) % 3]
    phase = list(PHASES)[turn // len(names) // 3]
    who = NAMES if name == "all" else (name,)
    later_s = draw.uniform(0.0, 2.0) if phase == "opening" else draw.uniform(0.0, 0.4)
    return Blow(name, tuple(draw.sample(who, len(who))), signal_number, phase, later_s, draw.uniform(0.2, 3.0))


def play(state: Path, folder: Path, blow: Blow, host: HostWatch) -> Found:
    """Play a round and check what must always hold. Raises HostStalled where the host ended the run before the blow."""
    settings = [word for setting in LONG_PHASES for word in ("--set", setting)]
    argv = ("run", "emulated", "--distance-m", "0.3", "--no-report", *settings, "--out", str(folder), "--json")
    began_ns = time.monotonic_ns()
    with started(state, *argv) as run:
        if PHASES[blow.phase]:
            try:
                run.wait_for(PHASES[blow.phase])
            except AssertionError:
                blame_the_host(host, began_ns, run.process.poll() or 0, run.err)
                raise
        time.sleep(blow.later_s)
        pids = _pids_with(blow.who, run, folder)
        at_ns = time.monotonic_ns()
        struck = [pids[who] for who in blow.who if who in pids and _sent(pids[who], blow.number)]
        time.sleep(0.5)
        stall_ms = max(host.worst_ms(at_ns, time.monotonic_ns()), host.worst_wait_ms(at_ns, time.monotonic_ns()))
        ended, gone_ns = _ended(run, blow, struck)
        run.wait_gone(GONE_WITHIN_S)
    assert "Traceback" not in ended.err, ended.err
    assert struck, f"nobody was there to be struck: {ended.err}"
    # All for a moment, or the launcher before it had started control: nothing had moved, and it may go on.
    slept = blow.number == STOP and (len(blow.who) > 1 or (blow.name == "launcher" and "control" not in pids))
    assert ended.code or blow.phase == "retreat" or (slept and blow.phase == "opening"), ended.err
    log = _whole_log(folder)
    if ended.code == 0:
        assert log == folder / "run.mcap", f"exit code 0 without a whole log: {ended.err}"
        _replays(folder)
    summary = _summary(folder)
    assert summary.get("exit_code", ended.code) == ended.code or ended.code < 0
    zero_ms, rest_ms, way_m, phase = (None, None, None, "") if log is None else _seen(log, at_ns)
    return Found(
        blow, ended.code, summary.get("verdict", ""), phase, zero_ms, rest_ms, way_m, (gone_ns - at_ns) / 1e9, stall_ms
    )


def _sent(pid: int, number: int) -> bool:
    """Send a signal; return whether there was anybody to send it to."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)
        return True
    return False


def _pids_with(who: tuple[str, ...], run: Run, folder: Path) -> dict[str, int]:
    """Return the processes that there are, once one of `who` is among them."""
    deadline_s = time.monotonic() + 20.0
    while not set(who) & set(pids := _pids(run, folder)):
        assert time.monotonic() < deadline_s, f"none of {who} was started: {run.err}"
        time.sleep(0.01)
    return pids


def _pids(run: Run, folder: Path) -> dict[str, int]:
    """Return the processes that there are, by name; while the run opens, it has not yet written who they are."""
    told = folder / "processes.json"
    if told.exists():
        with contextlib.suppress(ValueError):
            return {name: pid for name, pid in json.loads(told.read_text()).items() if name in NAMES}
    modules = {"emulators": "emulator_process", "recorder": "run.recorder", "gate": "gate_process",
               "arm": "ur10.child", "control": "control_process"}  # fmt: skip
    found = {name: pid for pid, command in run.alive().items() for name, part in modules.items() if part in command}
    return {"launcher": run.process.pid, **found}


def _ended(run: Run, blow: Blow, struck: list[int]) -> tuple[Ended, int]:
    """Wait for the end of the run; whoever was frozen wakes when only frozen ones are left, or after its time."""
    frozen = struck if blow.number == STOP else []
    deadline_s = time.monotonic() + ENDS_WITHIN_S
    if len(blow.who) > 1 and frozen:
        time.sleep(blow.wake_s)
    else:
        while set(run.alive()) - set(frozen):
            assert time.monotonic() < deadline_s, f"left after {ENDS_WITHIN_S} s: {run.alive()}"
            time.sleep(0.05)
    gone_ns = time.monotonic_ns()
    for pid in frozen:
        _sent(pid, signal.SIGCONT)
    return run.wait(ENDS_WITHIN_S), gone_ns


def _whole_log(folder: Path) -> Path | None:
    """Return the log, or what can be saved of it, or None."""
    log, saved = folder / "run.mcap", folder / "recovered.mcap"
    if not log.exists():
        return None
    try:
        for _ in read_log(log):
            pass
    except PushError:
        words = [*PUSH, "log", "recover", str(log), "--out", str(saved)]
        subprocess.run(words, cwd=ROOT, capture_output=True, timeout=60, check=False)
        return saved if saved.exists() else None
    return log


def _summary(folder: Path) -> dict[str, Any]:
    path = folder / "summary.json"
    summary: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return summary


def _replays(folder: Path) -> None:
    words = [*PUSH, "replay", str(folder), "--json"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def _seen(log: Path, at_ns: int) -> tuple[float | None, float | None, float | None, str]:
    """Return when zero came and the wheels stood (ms), the way until then (m), and the phase of the blow."""
    commands, _ = world_of(log)
    states = [STATE_CDR.decode(payload) for topic, _, payload, _ in read_log(log) if topic == "/world/state"]
    ticks = [TICK_CDR.decode(payload) for topic, _, payload, _ in read_log(log) if topic == "/control/tick"]
    before = [tick for tick in ticks if tick.input.now_ns <= at_ns]
    phase = Phase(before[-1].after.control.phase).name if before else ""
    rolling = [state for state in states if state.t_ns <= at_ns]
    if not rolling or stands(rolling[-1].velocity):
        return None, None, None, phase
    zero = next((t_ns for t_ns, twist in commands if t_ns >= at_ns and stands(twist)), None)
    rest = next((state.t_ns for state in states if state.t_ns >= at_ns and stands(state.velocity)), None)
    if rest is None:
        return None if zero is None else (zero - at_ns) / 1e6, None, None, phase
    way = [rolling[-1].base, *(state.base for state in states if at_ns <= state.t_ns <= rest)]
    way_m = sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(way))
    return None if zero is None else (zero - at_ns) / 1e6, (rest - at_ns) / 1e6, way_m, phase


def check_bounds(found: Found) -> None:
    """Check how far the base went on and when all was over, where the host kept still and the log can tell."""
    blow = found.blow
    if found.stall_ms > STALL_MS or found.rest_ms is None or found.way_m is None or blow.name == "all":
        return
    bound_m = WAY_M.get((blow.name, blow.number))
    assert bound_m is None or found.way_m <= bound_m, f"{in_words(found)}: more than {bound_m} m"
    after_s = GONE_WITHIN_S + (RECORDER_S if blow.name == "recorder" else 0.0)
    assert found.gone_s <= found.rest_ms / 1e3 + after_s, f"{in_words(found)}: later than {after_s} s after rest"


def in_words(found: Found) -> str:
    """Return a round as one line."""
    blow = found.blow
    times = " ".join(
        f"{name} {'unseen' if ms is None else f'{ms:.0f} ms'}"
        for name, ms in (("zero", found.zero_ms), ("rest", found.rest_ms))
    )
    way = "unseen" if found.way_m is None else f"{found.way_m * 1e3:.0f} mm"
    return (
        f"{blow.number.name} of {blow.name} in {blow.phase} ({found.phase}): code {found.code} {found.verdict!r}, "
        f"{times}, way {way}, all gone {found.gone_s:.1f} s, host held back {found.stall_ms:.0f} ms"
    )


def worst(found: list[Found]) -> str:
    """Return the worst of the rounds in which one process was struck and the host kept still."""
    quiet = [one for one in found if one.stall_ms <= STALL_MS and one.blow.name != "all"]
    lines = [f"{len(found)} rounds, {len(quiet)} of them at one process on a quiet host"]
    for name, value in (("time to zero", "zero_ms"), ("time to rest", "rest_ms"), ("way", "way_m"), ("end", "gone_s")):
        seen = [one for one in quiet if getattr(one, value) is not None]
        if seen:
            lines.append(f"worst {name}: {in_words(max(seen, key=lambda one: getattr(one, value)))}")
    return "\n".join(lines)
