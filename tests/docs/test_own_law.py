"""The page on a law of one's own is followed as a new user would: its code, outside of the tree, through `push`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from robot_io.mcap.read import read_log, read_summary
from robot_io.tick import TICK_CDR, Phase
from tests.forked_push import forked
from tests.push_runs import QUICK, pushed

PAGE = (Path(__file__).parents[2] / "docs/own-law.md").read_text(encoding="utf-8")
LAW = "steady:Steady"
SIM = ("run", "sim", "--fast", "--law", LAW, "--distance-m", "0.3", "--json", *QUICK)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the page's law in it."""
    [law] = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    path = tmp_path_factory.mktemp("mine")
    (path / "steady.py").write_text(law, encoding="utf-8")
    return path


@pytest.fixture
def push(state):
    """Run `push` in a folder."""
    return lambda folder, *argv: forked(state, *argv, cwd=folder)


@pytest.fixture(scope="module")
def simulated(folder, state):
    """Return the page's law's push at level sim."""
    done = forked(state, *SIM, "--out", "simulated", cwd=folder)
    assert done.code == 0, done.err
    return folder / "simulated"


def test_the_law_has_thirty_lines(folder):
    assert len((folder / "steady.py").read_text(encoding="utf-8").splitlines()) <= 30


def test_it_turns_no_faster_than_it_says_and_its_memory_is_logged(simulated):
    ticks = [TICK_CDR.decode(m.payload) for m in read_log(simulated / "run.mcap") if m.topic == "/control/tick"]
    pushing = [tick for tick in ticks if tick.after.control.phase == Phase.PUSH][
        1:
    ]  # found by the first, not yet pushed
    assert len(pushing) > 200
    assert read_summary(simulated / "run.mcap").metadata["run"]["law_state"] == "theta_p_rad"
    before = 0.0
    turned = 0
    for tick in pushing:
        control, twist = tick.after.control, tick.input.base.odometry
        assert control.law_state == (control.theta_p,)
        most = 2.0 * (twist.vx**2 + twist.vy**2) ** 0.5 * 0.01
        assert abs(control.theta_p - before) <= most + 1e-12
        turned += abs(abs(control.theta_p - before) - most) < 1e-9
        before = control.theta_p
    assert turned > 20, "the bound never mattered"


def test_it_replays_exactly_where_it_is_named(push, folder, simulated, tmp_path):
    replay = push(folder, "replay", str(simulated), "--law", LAW, "--json")
    assert replay.code == 0, replay.err
    assert replay.last_object["ticks"] == replay.last_object["identical"] > 200


@pytest.mark.parametrize("argv", [("replay",), ("replay", "--what-if", "control.k_f=0.2"), ("report",)])
def test_nothing_is_imported_that_was_not_named(push, folder, simulated, argv):
    done = push(folder, *argv, str(simulated))
    assert done.code == 3
    assert f"Add --law {LAW}" in done.err
    assert len(done.err.strip().splitlines()) == 1


def test_the_report_has_the_law_s_name(push, folder, simulated):
    assert push(folder, "report", str(simulated), "--law", LAW, "--out", "report").code == 0
    assert re.search(r"sim, steady, seed 0", (folder / "report/report.html").read_text(encoding="utf-8"))


def test_another_source_is_other_code(push, folder, simulated, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    law = (folder / "steady.py").read_text(encoding="utf-8")
    (other / "steady.py").write_text(law.replace("turn_rad_per_m * seen", "turn_rad_per_m * 0.5 * seen"))
    replay = push(other, "replay", str(simulated), "--law", LAW)
    assert replay.code == 7
    assert "made by other code" in replay.out
    assert "its law's source had SHA-256" in replay.out


def test_two_simulated_runs_are_the_same_bytes(push, folder, simulated):
    assert push(folder, *SIM, "--out", "again").code == 0
    assert (folder / "again/run.mcap").read_bytes() == (simulated / "run.mcap").read_bytes()


def test_its_settings_are_checked_and_logged(push, folder):
    wrong = push(folder, "config", "check", "sim", "--set", f'control.law="{LAW}"',
                 "--set", "control.law_settings.turn=1")  # fmt: skip
    assert wrong.code == 2
    assert "`turn` is not a setting of the law `steady:Steady`: it has turn_rad_per_m" in wrong.err
    shown = push(folder, "config", "show", "sim", "--set", f'control.law="{LAW}"', "--json")
    control = shown.last_object["rig"]["control"]
    assert control["law_settings"] == {"turn_rad_per_m": 2.0}
    assert control["law_facts"]["name"] == "steady"


@pytest.mark.long
def test_an_emulated_run_replays_and_lets_the_law_move_a_robot(push, folder, host):
    argv = ("run", "emulated", "--law", LAW, "--distance-m", "0.2", "--out", "emulated", "--json", *QUICK)
    done = pushed(folder, *argv, host=host)
    assert (done.code, done.last_object["verdict"]) == (0, "done"), done.err
    assert done.last_object["law"] == LAW
    replay = push(folder, "replay", "emulated", "--law", LAW, "--json")
    assert replay.code == 0, replay.err
    assert replay.last_object["ticks"] == replay.last_object["identical"] == done.last_object["loop"]["ticks"]
    ticks = [TICK_CDR.decode(m.payload) for m in read_log(folder / "emulated/run.mcap") if m.topic == "/control/tick"]
    assert any(tick.input.host.law_ns > 0 for tick in ticks), "no step was timed"


@pytest.mark.long
def test_a_comparison_names_both_laws(push, folder, simulated, tmp_path):
    paper = push(folder, "run", "sim", "--fast", "--distance-m", "0.3", "--out", "paper", *QUICK)
    assert paper.code == 0, paper.err
    done = push(folder, "report", "simulated", "paper", "--law", LAW, "--out", "compared", "--json")
    assert done.code == 0, done.err
    text = Path(folder / done.last_object["report"]).read_text(encoding="utf-8")
    assert "steady" in text
    assert "force feedback" in text
