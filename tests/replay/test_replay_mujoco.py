"""A world moved by MuJoCo is run again bit for bit, and another version of MuJoCo, or none, is named."""

import sys

import pytest

from tests.host_watch import repeated_when_the_host_stalls
from tests.replay.conftest import short_push
from tests.replay.runs import replayed, rewritten
from tools.cli import main

pytestmark = pytest.mark.long
ENGINE = ("--set", "world.engine=mujoco")


@pytest.fixture(scope="module")
def mujoco_log(tmp_path_factory):
    return short_push(tmp_path_factory.mktemp("push"), "sim", "--fast", *ENGINE) / "run.mcap"


def test_it_replays_to_the_last_bit(mujoco_log, capsys):
    code, told = replayed(capsys, mujoco_log)
    assert code == 0
    assert told["world"]["states"] == told["world"]["identical"] > 300
    assert told["notes"] == []


def test_the_same_seed_gives_the_same_bytes(mujoco_log, tmp_path):
    again = short_push(tmp_path, "sim", "--fast", *ENGINE) / "run.mcap"
    assert again.read_bytes() == mujoco_log.read_bytes()


def test_a_log_of_another_mujoco_is_named(mujoco_log, tmp_path, capsys):
    from mujoco import __version__ as installed

    def older(name, values):
        return {**values, "mujoco": "3.2.0"} if name == "run" else values

    code, told = replayed(capsys, rewritten(mujoco_log, tmp_path / "run.mcap", metadata=older))
    assert code == 0
    assert told["notes"] == [f"the world was made by MuJoCo 3.2.0, and run again by {installed}"]


def test_without_mujoco_everything_but_the_world_is_compared(mujoco_log, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "sim_backend.rigid.body", raising=False)
    code, told = replayed(capsys, mujoco_log)
    assert (code, told["world"]) == (0, None)
    assert told["ticks"] == told["identical"] > 300
    assert "the world was not compared: MuJoCo is not installed here" in told["notes"]


def test_without_mujoco_a_run_says_in_one_sentence_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "sim_backend.rigid.body", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    assert main(["run", "sim", "--fast", *ENGINE, "--out", str(tmp_path / "run")]) == 3
    err = capsys.readouterr().err.strip().splitlines()
    assert len([line for line in err if "MuJoCo is not installed" in line and "'.[mujoco]'" in line]) == 1
    assert not any("Traceback" in line for line in err)


@repeated_when_the_host_stalls
def test_real_drivers_push_it_over_the_wire(tmp_path, capsys, host):
    log = short_push(tmp_path, "emulated", *ENGINE, host=host) / "run.mcap"
    code, told = replayed(capsys, log)
    assert code == 0
    assert told["world"]["states"] == told["world"]["identical"] > 300
