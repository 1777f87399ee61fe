"""The page on adding a device is followed as a new user would: its code, outside of the tree, through `push`."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.forked_push import forked
from tests.push_runs import QUICK, pushed

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/add-a-device.md").read_text(encoding="utf-8")
KIND = "udp_sensor:UdpSensor"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the page's two files in it."""
    sensor, emulator = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    path = tmp_path_factory.mktemp("mine")
    (path / "udp_sensor.py").write_text(sensor, encoding="utf-8")
    (path / "udp_emulator.py").write_text(emulator, encoding="utf-8")
    return path


@pytest.fixture
def push(host):
    return partial(pushed, host=host)


def test_the_driver_is_under_eighty_lines(folder):
    lines = (folder / "udp_sensor.py").read_text(encoding="utf-8").splitlines()
    assert len([line for line in lines if line.strip()]) < 80


def test_a_push_with_the_pages_sensor_replays_exactly(push, folder, tmp_path):
    done = push(
        folder, "run", "emulated", "--set", f"ft.kind={KIND}", "--distance-m", "0.3", "--out", "out",
        "--json", *QUICK,
    )  # fmt: skip
    assert done.code == 0, done.err
    summary = done.last_object
    assert summary["verdict"] == "done"
    assert abs(summary["distance_m"] - 0.3) < 0.05
    seconds = summary["loop"]["ticks"] / 100.0
    assert summary["devices"][KIND]["packets_ok"] > 900 * seconds, "a thousand readings a second"
    elsewhere = tmp_path / "elsewhere"  # where its module cannot be found
    elsewhere.mkdir()
    replay = push(elsewhere, "replay", str(folder / "out"), "--json")
    assert replay.code == 0, replay.err
    assert replay.last_object["ticks"] == replay.last_object["identical"] == summary["loop"]["ticks"]


@pytest.mark.long
def test_the_same_sensor_at_level_sim(push, folder, tmp_path):
    done = push(
        folder, "run", "sim", "--fast", "--set", f"ft.kind={KIND}", "--distance-m", "0.3",
        "--out", str(tmp_path / "out"), "--json", "--no-report",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert done.last_object["devices"][KIND]["packets_ok"] > 9.0 * done.last_object["loop"]["ticks"]
    assert push(tmp_path, "replay", "out").code == 0


def test_its_options_and_limits_are_checked_before_anything_moves(folder, state):
    kind = ("--set", f"ft.kind={KIND}")
    option = forked(state, "run", "emulated", *kind, "--set", "ft.options.gain=2", "--no-report", cwd=folder)
    assert (option.code, option.err.count("Traceback")) == (2, 0)
    assert "no option `gain`" in option.err
    torque = forked(state, "config", "check", "emulated", *kind, "--set", "limits.max_torque_Nm=19.9", cwd=folder)
    assert torque.code == 0
    too_high = forked(state, "config", "check", "emulated", *kind, "--set", "limits.max_force_N=181", cwd=folder)
    assert too_high.code == 2


def test_the_contract_suite_takes_it(folder):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "tests/contract"],
        cwd=ROOT, env=os.environ | {"PUSH_TEST_KIND": f"ft={KIND}", "PUSH_TEST_KIND_FOLDER": str(folder)},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=80, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"1[0-9] passed", done.stdout), done.stdout
