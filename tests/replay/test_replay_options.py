"""Gaps, other machines and programs, tolerance, other settings over the same inputs."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from tests.replay.runs import replayed, rewritten
from tools.cli import main
from tools.replay.difference import difference


def test_ticks_that_did_not_fit_into_the_ring_are_a_counted_gap(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    part = sim_ticks[pushing_at : pushing_at + 60]
    log = write_log(tmp_path / "run.mcap", part[:10] + part[13:30] + part[40:])
    code, told = replayed(capsys, log)
    assert (code, told["ticks"], told["identical"], told["gaps"]) == (0, 47, 47, 2)
    assert main(["replay", str(log)]) == 0
    assert "gaps: 2" in capsys.readouterr().out
    altered = replace(part[45], output=replace(part[45].output, exit_code=3))
    log = write_log(tmp_path / "altered.mcap", part[:10] + part[13:30] + part[40:45] + [altered] + part[46:])
    code, told = replayed(capsys, log)
    assert (code, told["gaps"], told["identical"]) == (7, 2, 46)
    assert told["first_difference"]["tick"] == altered.input.tick


def test_a_gap_behind_which_no_state_is_known_is_a_difference(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    """Only every 10 s does a log of today hold all that a tick needs of the one before."""
    part = sim_ticks[pushing_at : pushing_at + 20]
    later = [replace(part[13], before=()), *part[14:]]
    code, told = replayed(capsys, write_log(tmp_path / "run.mcap", part[:10] + later))
    assert (code, told["ticks"], told["identical"], told["gaps"]) == (7, 17, 10, 1)
    assert (told["first_difference"]["tick"], told["first_difference"]["field"]) == (part[13].input.tick, "before")


def test_a_log_without_the_state_to_start_from_is_damaged(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    part = sim_ticks[pushing_at : pushing_at + 3]
    log = write_log(tmp_path / "run.mcap", [replace(part[0], before=()), *part[1:]])
    for more in ((), ("--what-if", "control.k_f=0.31")):
        assert replayed(capsys, log, *more)[0] == 8


def test_skipped_periods_are_no_gap(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    a, b = sim_ticks[pushing_at], sim_ticks[pushing_at + 1]
    late = replace(b.input, tick=a.input.tick + 3, host=replace(b.input.host, skipped=2))
    # The fold sees the skip, so only the counting is of interest here.
    code, told = replayed(capsys, write_log(tmp_path / "run.mcap", [a, replace(b, input=late)]))
    assert told["gaps"] == 0
    assert code == 7


def test_world_records_that_did_not_fit_are_said_and_not_compared(sim_log, tmp_path, capsys):
    log = rewritten(
        sim_log,
        tmp_path / "run.mcap",
        metadata=lambda name, values: {**values, "dropped_world": "3"} if name == "run_end" else values,
    )
    code, told = replayed(capsys, log)
    assert (code, told["world"]) == (0, None)
    assert "did not fit" in told["notes"][0]


def other_machine(name: str, values: dict[str, str]) -> dict[str, str]:
    return (
        {**values, "python": "3.99.1", "libm": "musl 1.2", "program": "single-point-push 9.9"}
        if name == "run"
        else values
    )


def test_another_program_python_or_libm_is_said_when_outputs_differ(sim_log, tmp_path, capsys):
    log = rewritten(
        sim_log,
        tmp_path / "run.mcap",
        config=lambda text: text.replace("k_f = 0.3", "k_f = 0.31"),
        metadata=other_machine,
    )
    assert main(["replay", str(log)]) == 7
    out = capsys.readouterr().out
    for words in ("python was 3.99.1", "libm was musl 1.2", "program was single-point-push 9.9"):
        assert words in out
    same = rewritten(sim_log, tmp_path / "same.mcap", metadata=other_machine)
    assert main(["replay", str(same)]) == 0
    assert "3.99.1" not in capsys.readouterr().out
    assert len(replayed(capsys, same)[1]["machine_differences"]) == 3


def test_tolerance_accepts_rounding_and_nothing_larger(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    part = sim_ticks[pushing_at : pushing_at + 20]
    after = part[10].after
    control = replace(after.control, lateral_m=after.control.lateral_m + 1e-12)
    part = [*part[:10], replace(part[10], after=replace(after, control=control)), *part[11:]]
    log = write_log(tmp_path / "run.mcap", part)
    assert replayed(capsys, log)[0] == 7
    code, told = replayed(capsys, log, "--tolerance", "1e-9")
    assert (code, told["identical"]) == (0, 20)
    assert replayed(capsys, log, "--tolerance", "1e-13")[0] == 7
    assert replayed(capsys, log, "--tolerance", "0")[0] == 7


@pytest.mark.parametrize("value", ["-1", "nan", "x"])
def test_a_tolerance_that_is_none_is_usage(value, sim_log, capsys):
    code, told = replayed(capsys, sim_log, f"--tolerance={value}")
    assert (code, told["error"]["code"]) == (2, 2)


class Holds(msgspec.Struct):
    value: Any


@pytest.mark.parametrize("holds", [lambda value: (value,), Holds, lambda value: Holds((Holds(value), 1.0))])
def test_differences_are_by_bits_or_by_tolerance(holds):
    def differ(old: object, new: object, tolerance: float | None = None) -> bool:
        return difference(0, holds(old), holds(new), tolerance) is not None

    assert not differ(math.nan, math.nan)
    assert differ(math.nan, -math.nan)
    assert differ(0.0, -0.0)
    assert differ(1, 1.0)
    assert differ(True, 1)
    assert differ((1.0,), (1.0, 1.0))
    assert not differ(0.0, -0.0, 0.0)
    assert not differ(math.nan, -math.nan, 0.0)
    assert not differ(math.inf, math.inf, 1e-9)
    assert differ(math.inf, -math.inf, 1e-9)
    assert differ(math.inf, 1.0, 1e9)
    assert differ(1.0, math.nan, 1e9)
    assert differ(1, 2, 5.0)
