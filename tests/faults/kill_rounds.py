"""One process of a pushing run killed or frozen: when the base was told zero, when its wheels stood, what stayed.

All times are CLOCK_MONOTONIC: the signal's here, a command's arrival and the wheels' in the log of the emulated world.
A round in which the host did not let gate and emulators (with a launcher that is to die: launcher and control, too) run
for 10 ms in all, from the signal until the wheels stood (the kernel's own count of time spent waiting for a processor),
or a processor stood still for that long, says nothing and is repeated. All together, because each waits for the one
before: a launcher's death kills control, control's death tells the gate, and the gate tells the base.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.host_watch import REPEATS, UNMEASURED, HostStalled, HostWatch
from tests.push_runs import QUICK, Ended, Run, stands, started, world_of

PUSHING = r"PUSH +(?!0\.00/)[0-9.]+/.* v {speed:.2f} m/s"
STALL_MS = 10.0
WATCHED_NS = 120_000_000


class Round(NamedTuple):
    """What came of a kill; times in ms after it, None where it never came."""

    ended: Ended
    folder: Path
    zero_ms: float | None
    rest_ms: float | None
    stall_ms: float
    gone_ms: float
    last_state_ms: float
    struck_ns: int
    """When the signal was sent, CLOCK_MONOTONIC."""


@contextlib.contextmanager
def pushing(
    state: Path, folder: Path, host: HostWatch, *, speed: float = 0.1, **popen: Any
) -> Iterator[tuple[Run, dict[str, int]]]:
    """Give a run in the middle of its push at `speed` (m/s), and its processes by name."""
    fast = ("--set", f"control.push_speed_m_per_s={speed}")
    argv = ("run", "emulated", "--distance-m", "5", *QUICK, *fast, "--out", str(folder), "--json")
    with started(state, *argv, host=host, **popen) as run:
        run.wait_for(PUSHING.format(speed=speed))
        yield run, json.loads((folder / "processes.json").read_text())


def strike(
    state: Path,
    folder: Path,
    name: str,
    number: signal.Signals,
    host: HostWatch,
    *,
    log: str = "run.mcap",
    speed: float = 0.1,
) -> Round:
    """Send a signal to one process of a pushing run, wait for the end of everything, and read its log.

    name: of the process, or of several with a space between.
    """
    with pushing(state, folder, host, speed=speed) as (run, pids):
        watched = {pids[who] for who in ("gate", "emulators", *(("launcher", "control") if name == "launcher" else ()))}
        waits = [(time.monotonic_ns(), _waited_ms(watched))]
        at_ns = time.monotonic_ns()
        for one in name.split():
            os.kill(pids[one], number)
        while waits[-1][0] < at_ns + WATCHED_NS:
            time.sleep(0.002)
            waits.append((time.monotonic_ns(), waits[-1][1] | _waited_ms(watched)))  # who is gone keeps its last count
        ended = run.wait(20.0)
        run.wait_gone(3.0)
        gone_ms = (time.monotonic_ns() - at_ns) / 1e6
    if not (folder / log).exists():
        return Round(ended, folder, None, None, _stall_ms(host, waits, at_ns, None), gone_ms, 0.0, at_ns)
    commands, wheels = world_of(folder / log)
    moving = [twist for t_ns, twist in wheels if t_ns <= at_ns]
    assert moving, "the base was not yet there"
    assert not stands(moving[-1]), "it was to be killed while the base moves"
    zero = next((t_ns for t_ns, twist in commands if t_ns >= at_ns and stands(twist)), None)
    rest = next((t_ns for t_ns, twist in wheels if t_ns >= at_ns and stands(twist)), None)
    return Round(
        ended,
        folder,
        None if zero is None else (zero - at_ns) / 1e6,
        None if rest is None else (rest - at_ns) / 1e6,
        _stall_ms(host, waits, at_ns, rest),
        gone_ms,
        (wheels[-1][0] - at_ns) / 1e6,
        at_ns,
    )


def within(
    state: Path,
    tmp_path: Path,
    name: str,
    number: signal.Signals,
    host: HostWatch,
    *,
    zero_ms: float | None,
    rest_ms: float,
) -> Round:
    """Strike until a round keeps its bounds; only one that the host stalled is repeated, three times at most.

    Where the host stalled each of them, the bounds are reported as unmeasured, and the last round is judged by its
    order: a zero where one can come, and wheels at rest after it. Without `--measure-all` the first round that came
    to its blow is the last one: beside another worker of `make test` most rounds are held back.

    zero_ms: the zero command's bound (None: none can come). rest_ms: the wheels' bound after it, or after the
    signal where no command comes.
    """
    last: Round | None = None
    for attempt in range(1 + REPEATS):
        try:
            found = strike(state, tmp_path / f"run{attempt}", name, number, host)
        except HostStalled as stalled:
            print(f"{number.name} of {name}, round {attempt + 1}: repeated: {stalled}")
            continue
        told = f"{number.name} of {name}, round {attempt + 1}: zero {_ms(found.zero_ms)}, wheels at rest "
        told += f"{_ms(found.rest_ms)}, all gone {found.gone_ms:.0f} ms, host held back {found.stall_ms:.1f} ms"
        print(told)
        if _kept(found, zero_ms, rest_ms):
            return found
        assert found.stall_ms > STALL_MS, f"{told}; bounds: {_ms(zero_ms)}, then {_ms(rest_ms)}"
        print("  repeated: the host stalled")
        last = found
        if not UNMEASURED.fails:
            break
    UNMEASURED.add(f"{number.name} of {name}: zero within {_ms(zero_ms)}, rest within {_ms(rest_ms)}")
    if last is None:
        pytest.skip(f"unmeasured: the host stalled each of {1 + REPEATS} pushes before the blow")
    assert last.rest_ms is not None, "the wheels never stood"
    assert zero_ms is None or (last.zero_ms is not None and last.zero_ms <= last.rest_ms), "no zero before the rest"
    return last


def _kept(found: Round, zero_ms: float | None, rest_ms: float) -> bool:
    if found.rest_ms is None:
        return False
    if zero_ms is None:
        return found.rest_ms <= rest_ms
    return found.zero_ms is not None and found.zero_ms <= zero_ms and found.rest_ms <= found.zero_ms + rest_ms


def _stall_ms(host: HostWatch, waits: list[tuple[int, dict[int, float]]], at_ns: int, rest_ns: int | None) -> float:
    """Return how long the host held the round back between the blow and the wheels' rest, as far as it was watched."""
    until_ns = waits[-1][0] if rest_ns is None else min(rest_ns, waits[-1][0])
    last = next(waited for t_ns, waited in waits if t_ns >= until_ns)
    return max(host.worst_ms(at_ns, until_ns), sum(last[pid] - waited for pid, waited in waits[0][1].items()))


def _waited_ms(pids: set[int]) -> dict[int, float]:
    """Return how long each process has waited for a processor so far; one that is gone is left out."""
    waited = {}
    for pid in pids:
        with contextlib.suppress(OSError):
            waited[pid] = int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) / 1e6
    return waited


def _ms(value: float | None) -> str:
    return "never" if value is None else f"{value:.1f} ms"
