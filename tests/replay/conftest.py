"""One short push of each level, made once for all tests of replay, and a writer of logs of chosen ticks."""

from __future__ import annotations

from pathlib import Path

import pytest

from robot_io.tick import TICK_CDR, ControlTick, Phase
from tests.replay.runs import push, ticks_in
from tools.run_log import RunLog

QUICK = (
    *("--set", "ft.tare_seconds_s=0.3"),
    *("--set", "control.approach_speed_m_per_s=0.1"),
    *("--set", "control.ramp_s=0.3"),
    *("--set", "control.retreat_m=0.0"),
)
"""Less waiting around the push."""


def short_push(tmp_path_factory: pytest.TempPathFactory, *words: str) -> Path:
    folder = tmp_path_factory.mktemp("push")
    out = folder / "run"
    done = push("run", *words, *QUICK, "--distance-m", "0.2", "--out", out, "--no-report", state=folder / "state")
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="session")
def sim_run(tmp_path_factory) -> Path:
    return short_push(tmp_path_factory, "sim", "--fast")


@pytest.fixture(scope="session")
def emulated_run(tmp_path_factory) -> Path:
    return short_push(tmp_path_factory, "emulated")


@pytest.fixture(scope="session")
def sim_log(sim_run) -> Path:
    return sim_run / "run.mcap"


@pytest.fixture(scope="session")
def sim_ticks(sim_log) -> list[ControlTick]:
    return ticks_in(sim_log)


@pytest.fixture(scope="session")
def pushing_at(sim_ticks) -> int:
    """Index of a tick in the middle of the push."""
    pushing = [i for i, tick in enumerate(sim_ticks) if tick.before.control.phase == Phase.PUSH]
    return pushing[len(pushing) // 2]


@pytest.fixture(scope="session")
def write_log(sim_run):
    """Return a function that writes ticks as a log of their own, chained and sealed by the program itself."""
    config = (sim_run / "config.toml").read_text()

    def write(path: Path, ticks: list[ControlTick], facts: dict[str, str] | None = None) -> Path:
        log = RunLog(path, config_text=config, metadata=facts or {}, wall_offset_ns=10**18)
        for tick in ticks:
            log.tick(tick.input.now_ns, TICK_CDR.encode(tick), tick)
        log.finish({})
        return path

    return write
