"""One short push of each level, made once for all tests of replay, and a writer of logs of chosen ticks."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest

from robot_io.log.log_format import FORMAT_FACT, LOG_FORMAT
from robot_io.tick import TICK_CDR, ControlTick, Phase
from tests.forked_push import forked
from tests.host_watch import HostWatch, repeated_when_the_host_stalls
from tests.made_once import made_once
from tests.push_runs import QUICK, finished
from tests.replay.runs import as_logged, ticks_in
from tools.log.run_log import RunLog


def short_push(folder: Path, *words: str, host: HostWatch | None = None) -> Path:
    out = folder / "run"
    argv = ("run", *words, *QUICK, "--distance-m", "0.2", "--out", str(out))
    done = forked(folder / "state", *argv) if host is None else finished(folder / "state", *argv, host=host)
    assert done.code == 0, done.err
    return out


@pytest.fixture(scope="session")
def sim_run(tmp_path_factory) -> Path:
    return short_push(tmp_path_factory.mktemp("push"), "sim", "--fast")


@pytest.fixture(scope="session")
def emulated_run(tmp_path_factory) -> Path:
    def make(folder: Path) -> Path:
        found = []

        @repeated_when_the_host_stalls
        def run(tmp_path):
            found.append(short_push(tmp_path, "emulated", host=host))

        with contextlib.closing(HostWatch()) as host:
            run(tmp_path=folder)
        return found[-1]

    return made_once(tmp_path_factory, "emulated_push", make)


@pytest.fixture(scope="session")
def sim_log(sim_run) -> Path:
    return sim_run / "run.mcap"


@pytest.fixture(scope="session")
def sim_ticks(sim_log) -> list[ControlTick]:
    return ticks_in(sim_log)


@pytest.fixture(scope="session")
def pushing_at(sim_ticks) -> int:
    """Index of a tick in the middle of the push."""
    pushing = [i for i, tick in enumerate(sim_ticks) if tick.before[0].control.phase == Phase.PUSH]
    return pushing[len(pushing) // 2]


@pytest.fixture(scope="session")
def write_log(sim_run):
    """Return a function that writes ticks as a log of their own, chained and sealed by the program itself."""
    config = (sim_run / "config.toml").read_text()

    def write(path: Path, ticks: list[ControlTick], facts: dict[str, str] | None = None) -> Path:
        said = {FORMAT_FACT: str(LOG_FORMAT), **(facts or {})}
        log = RunLog(path, config_text=config, metadata=said, wall_offset_ns=10**18)
        for tick in as_logged(ticks):
            log.tick(tick.input.now_ns, TICK_CDR.encode(tick), tick)
        log.finish({"dropped_gate": "1"})  # there is nothing of the gate in it
        return path

    return write
