"""`push replay --what-if`: where law, safe command, mode and faults would differ, against real simulated runs.

A simulated run is the same to the last bit every time, so a second run with the other settings must agree with the
answer up to the tick that it calls exact.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import Mode
from tests.forked_push import forked
from tests.push_runs import QUICK
from tests.replay.runs import replayed, ticks_in
from tools.cli import main

FORCE_LIMIT = ("limits.max_force_N=10", "limits.slow_force_N=9")
STOP_TICKS = 150
"""After a stop the run ends when the base is at rest, here it never is, or after 1.5 s: 150 ticks of 10 ms."""


def what_if(capsys, log: Path, *settings: str) -> dict[str, Any]:
    code, told = replayed(capsys, log, *(word for setting in settings for word in ("--what-if", setting)))
    assert code == 0, told
    assert told["open_loop"] is True
    return told


def bits(value: object) -> bytes:
    """Return a value as bytes, in which NaN equals NaN."""
    return msgspec.msgpack.encode(value)


@pytest.fixture(scope="module")
def run_with(tmp_path_factory):
    """Return a function that repeats the run of `sim_log` with other settings, and gives the folder."""

    def run(*settings: str) -> Path:
        folder = tmp_path_factory.mktemp("again")
        words = [word for setting in settings for word in ("--set", setting)]
        same = ("run", "sim", "--fast", *QUICK, "--set", "control.distance_m=0.2")
        forked(folder / "state", *same, *words, "--out", str(folder / "run"))
        return folder / "run"

    return run


@pytest.fixture(scope="module")
def stopped_run(run_with) -> Path:
    return run_with(*FORCE_LIMIT)


def test_a_force_limit_answers_as_a_run_with_it_does(sim_log, stopped_run, capsys):
    told = what_if(capsys, sim_log, *FORCE_LIMIT)
    run = json.loads((stopped_run / "summary.json").read_text())["first_fault"]
    fault = told["new_faults"][0]
    assert (fault["id"], fault["limit"], fault["unit"]) == ("F50-stop", 10.0, "N")
    assert fault["value"] == run["value"] > 10.0
    assert fault["at_s"] == run["at_s"]
    stop = fault["tick"]
    assert told["exact_to_tick"] == told["first"]["tick"] == stop
    assert told["first"]["parts"] == ["command", "mode", "faults"]
    assert told["parts"]["wanted"]["ticks"] == 0
    command = told["parts"]["command"]["first"]
    assert command["what_if"] == [0.0, 0.0, 0.0]
    assert command["log"][0] > 0.0
    assert told["parts"]["mode"]["first"] == {
        "tick": stop,
        "at_s": fault["at_s"],
        "log": "PUSHING",
        "what_if": "STOP",
    }
    assert told["parts"]["faults"]["first"]["log"] == []
    assert told["parts"]["faults"]["first"]["what_if"] == ["F50-stop"]


def test_a_stop_stays_latched_to_the_end_of_its_run(sim_log, capsys):
    told = what_if(capsys, sim_log, *FORCE_LIMIT)
    stop, ticks = told["first"]["tick"], len(ticks_in(sim_log))
    assert told["what_if_end"]["tick"] == stop + STOP_TICKS
    assert told["what_if_end"]["exit_code"] == 5
    assert told["log_end"] == {"tick": ticks - 1, "at_s": (ticks - 1) / 100, "exit_code": 0}
    for part in ("command", "mode", "faults"):
        assert told["parts"][part]["ticks"] == STOP_TICKS + 1, part
    assert (told["ticks"], told["not_run"]) == (stop + STOP_TICKS + 1, ticks - stop - STOP_TICKS - 1)


def test_what_the_measurements_cause_by_not_reacting_comes_behind_the_exact_part(sim_log, capsys):
    told = what_if(capsys, sim_log, *FORCE_LIMIT)
    later = told["new_faults"][1]
    assert later["id"] == "F34"  # the base of the log goes on although the stop was latched
    assert later["tick"] > told["exact_to_tick"]
    assert main(["replay", str(sim_log), *(w for one in FORCE_LIMIT for w in ("--what-if", one))]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("open loop: ")
    assert any(line.startswith("  with these settings only: F50-stop") and "limit 10 N" in line for line in lines)
    assert any(line.startswith("  with these settings only (open loop): F34") for line in lines)
    assert f"  mode: differs in {STOP_TICKS + 1}, first in tick {told['first']['tick']}: PUSHING -> STOP" in lines
    assert any(line.startswith(f"exact up to tick {told['exact_to_tick']}, ") for line in lines)


def test_a_fault_that_the_other_settings_would_not_have_found(stopped_run, capsys):
    told = what_if(capsys, stopped_run / "run.mcap", "limits.max_force_N=150", "limits.slow_force_N=100")
    assert [fault["id"] for fault in told["missing_faults"]] == ["F50-stop"]
    assert told["new_faults"] == []
    assert told["parts"]["mode"]["first"]["log"] == "STOP"
    assert told["parts"]["mode"]["first"]["what_if"] == "PUSHING"
    assert (told["log_end"]["exit_code"], told["what_if_end"]) == (5, None)
    main(["replay", str(stopped_run), "--what-if", "limits.max_force_N=150", "--what-if", "limits.slow_force_N=100"])
    assert "the run would go on where the log ends" in capsys.readouterr().out


def test_settings_that_no_run_would_take_are_answered_with_a_note(sim_log, capsys):
    told = what_if(capsys, sim_log, "limits.max_force_N=10")  # the slow limit stays at 100 N
    assert told["new_faults"][0]["id"] == "F50-stop"
    assert told["notes"] == [
        "`push run` would refuse these settings: limits.slow_force_N must be below limits.max_force_N"
    ]


ANSWERED = [
    ("control.k_f=0.1", ("wanted", "command"), "PUSH"),
    ("control.k_y_rad_per_m=1.5", ("wanted", "command"), "PUSH"),
    ("control.push_speed_m_per_s=0.2", ("wanted", "command"), "PUSH"),
    ("control.distance_m=0.1", ("wanted", "command"), "PUSH"),
    ("control.force_filter_tau_s=0.5", ("wanted", "command"), "PUSH"),
    ("control.contact_samples=2", ("wanted", "command"), "APPROACH"),
    ("ft.tare_s=0.5", ("wanted", "command"), "APPROACH"),
    ("limits.slow_force_N=8", ("faults", "mode"), "APPROACH"),
    ("limits.max_torque_Nm=0.5", ("faults", "mode"), "PUSH"),
    ("limits.max_heading_error_deg=0.01", ("faults", "mode"), "TARE"),
    ("limits.max_acceleration_m_per_s2=0.05", ("wanted", "command"), "APPROACH"),
    ("workspace={x_m=[-9.0, 0.0], y_m=[-9.0, 9.0]}", ("faults", "mode", "command"), "APPROACH"),
    ("path.direction_deg=5.0", ("wanted", "command"), "APPROACH"),
    ("path.expected_contact_m=1.0", ("faults",), "PUSH"),
]
"""A setting, parts of which something must differ, and the phase of the log where it first does."""
ALWAYS = (
    "control.k_f", "control.distance_m", "ft.tare_s", "limits.slow_force_N", "limits.max_heading_error_deg",
    "workspace", "path.direction_deg",
)  # fmt: skip


@pytest.mark.parametrize(
    ("setting", "parts", "phase"),
    [
        pytest.param(*row, id=row[0], marks=() if row[0].partition("=")[0] in ALWAYS else pytest.mark.long)
        for row in ANSWERED
    ],
)
def test_settings_of_law_and_safety_are_answered(setting, parts, phase, sim_log, capsys):
    told = what_if(capsys, sim_log, setting)
    assert {part for part in parts if told["parts"][part]["ticks"]} == set(parts)
    assert told["first"]["phase"] == phase


def test_the_log_s_own_value_changes_nothing(sim_log, capsys):
    told = what_if(capsys, sim_log, "control.k_f=0.3")
    assert (told["changed"], told["first"], told["exact_to_tick"]) == (0, None, None)
    assert told["ticks"] == len(ticks_in(sim_log))
    assert told["log_end"] == told["what_if_end"]
    assert (told["new_faults"], told["missing_faults"], told["not_run"], told["notes"]) == ([], [], 0, [])


@pytest.mark.long
def test_a_log_of_the_wall_clock_is_answered_too(emulated_run, capsys):
    log = emulated_run / "run.mcap"
    own = what_if(capsys, log, "control.k_f=0.3")
    assert (own["changed"], own["exact_to_tick"], own["notes"]) == (0, None, [])
    told = what_if(capsys, log, *FORCE_LIMIT)
    assert told["new_faults"][0]["id"] == "F50-stop"
    assert told["what_if_end"]["exit_code"] == 5


@pytest.mark.long
@pytest.mark.parametrize(
    "setting",
    [
        "control.k_f=0.1",
        "control.push_speed_m_per_s=0.15",
        "control.distance_m=0.1",
        "control.force_filter_tau_s=0.5",
        "control.contact_samples=2",
        "limits.max_torque_Nm=0.5",
        "limits.slow_force_N=8.0",
        "limits.max_acceleration_m_per_s2=0.05",
    ],
)
def test_a_run_with_the_settings_agrees_up_to_the_tick_that_is_called_exact(setting, sim_log, run_with, capsys):
    told = what_if(capsys, sim_log, setting)
    exact = told["exact_to_tick"]
    again, log = ticks_in(run_with(setting) / "run.mcap"), ticks_in(sim_log)
    for number in range(exact):
        assert bits(again[number].input) == bits(log[number].input), number
        assert again[number].output.command_body == log[number].output.command_body, number
    output = again[exact].output
    got = {"command": output.command_body, "mode": Mode(output.mode).name, "faults": list(output.faults)}
    for part, value in got.items():
        first = told["parts"][part]["first"]
        if first is not None and first["tick"] == exact:
            assert value == (BodyTwist(*first["what_if"]) if part == "command" else first["what_if"])
    assert output.command_body != log[exact].output.command_body or output.mode != log[exact].output.mode


REFUSED = [
    ("world.mocap_noise_m=0.002", "the simulated world is not run again"),
    ("world.sensor.noise_force_N=0.0", "the simulated world is not run again"),
    ("loop.rate_hz=200", "the ticks of a log keep the rate at which they ran"),
    ("ft.port=/dev/ttyUSB3", "it changes no setting of the law or the safety checks"),
    ("ft.level=hardware", "the log holds what the devices of then sent"),
    ("ft.kind=other", "the log holds what the devices of then sent"),
    ("arm.host=192.0.2.1", "it changes no setting of the law or the safety checks"),
    ("arm.hold=servo", "the log's arm was held as it was then"),
    ("base.pose_source=odometry", "the log's poses come from where they came from then"),
    ("base.topics.command=/other", "the log holds what the devices of then sent"),
    ("frames.base_from_marker=[0, 0, 0.1]", "the log's poses are already those of the base"),
    ("sliders.pressure=rim", "it changes no setting of the law or the safety checks"),
    ("name=other", "it changes no setting of the law or the safety checks"),
    ("description=other", "it changes no setting of the law or the safety checks"),
]


@pytest.mark.parametrize(("setting", "reason"), REFUSED, ids=[row[0] for row in REFUSED])
def test_keys_that_cannot_matter_are_refused_by_name(setting, reason, sim_log, capsys):
    code, told = replayed(capsys, sim_log, "--what-if", setting)
    assert code == 2
    assert told["error"]["where"] == "--what-if"
    assert f"`{setting.partition('=')[0]}` cannot change a replay: {reason}" in told["error"]["what"]


def test_among_several_keys_those_that_cannot_matter_are_refused(sim_log, capsys):
    words = ("--what-if", "control.k_f=0.1", "--what-if", "ft.port=x", "--what-if", "loop.rate_hz=200")
    code, told = replayed(capsys, sim_log, *words)
    assert code == 2
    assert "`ft.port`" in told["error"]["what"]
    assert "`loop.rate_hz`" in told["error"]["what"]
    assert "control.k_f" not in told["error"]["what"]


@pytest.mark.parametrize("setting", ["control.k_g=0.1", "control.k_f=fast", "control.k_f=3", "k_f", "control.k_f"])
def test_what_is_no_setting_is_usage(setting, sim_log, capsys):
    code, told = replayed(capsys, sim_log, "--what-if", setting)
    assert code == 2
    assert told["error"]["what"]
    assert told["error"]["where"].startswith("--what-if")


def test_a_tolerance_is_refused_beside_it(sim_log, capsys):
    code, told = replayed(capsys, sim_log, "--what-if", "control.k_f=0.1", "--tolerance", "1e-9")
    assert (code, told["error"]["where"]) == (2, "push replay")


def test_a_gap_before_the_first_difference_is_bridged_by_the_log_s_state(
    sim_ticks, pushing_at, write_log, tmp_path, capsys
):
    part = sim_ticks[pushing_at : pushing_at + 30]
    log = write_log(tmp_path / "run.mcap", part[:10] + part[15:])
    told = what_if(capsys, log, "limits.max_torque_Nm=15.0")
    assert (told["ticks"], told["changed"], told["notes"]) == (25, 0, [])


def test_behind_a_gap_the_state_of_other_settings_is_not_known(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    part = sim_ticks[pushing_at : pushing_at + 30]
    log = write_log(tmp_path / "run.mcap", part[:10] + part[15:])
    told = what_if(capsys, log, "control.k_f=0.1")
    assert told["ticks"] == 10
    assert told["notes"] == [
        f"ticks are missing before tick {part[15].input.tick}: the state with the other settings is not known there, "
        "so nothing was compared from there on"
    ]


def test_a_log_that_today_s_program_computes_otherwise_is_said(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    part = sim_ticks[pushing_at : pushing_at + 5]
    other = replace(part[2], output=replace(part[2].output, command_body=BodyTwist(0.5, 0.0, 0.0)))
    told = what_if(capsys, write_log(tmp_path / "run.mcap", [*part[:2], other, *part[3:]]), "control.k_f=0.3")
    assert (told["changed"], told["exact_to_tick"]) == (0, part[2].input.tick)
    assert f"does not compute the outputs of the log itself (from tick {part[2].input.tick} on" in told["notes"][0]
