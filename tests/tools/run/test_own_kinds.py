"""Devices of another maker in a run: an arm and a base over UDP, and everything a kind can get wrong."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.push_runs import QUICK, started

OWN = Path(__file__).with_name("own_devices.py")


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "mine"
    path.mkdir()
    shutil.copy(OWN, path)
    return path


def push(folder, *argv):
    with started(folder.parent / "state", *argv, cwd=folder) as run:
        ended = run.wait()
        assert run.alive() == {}
        return ended


@pytest.mark.parametrize("device", ["arm=own_devices:Arm", "base=own_devices:Base"])
def test_a_push_with_an_arm_or_base_of_ones_own_replays(folder, device):
    name, _, kind = device.partition("=")
    done = push(
        folder,
        "run",
        "emulated",
        "--set",
        f"{name}.kind={kind}",
        "--distance-m",
        "0.2",
        "--out",
        "out",
        "--json",
        *QUICK,
    )
    assert (done.code, done.last_object["verdict"]) == (0, "done"), done.err
    assert kind in done.last_object["devices"]
    assert push(folder, "replay", "out").code == 0


def test_an_arm_that_says_it_may_be_moved_stops_the_push(folder):
    done = push(
        folder, "run", "emulated", "--set", "arm.kind=own_devices:Arm", "--set", "arm.options.free_after=300",
        "--distance-m", "1", "--out", "out", "--json", *QUICK,
    )  # fmt: skip
    assert done.code == 5, done.err
    assert done.last_object["faults"] == ["F27"]


def test_beside_the_rig_file_it_is_found_from_anywhere(folder, tmp_path):
    (folder / "mine.toml").write_text(
        'extends = "emulated"\nname = "mine"\n[arm]\nkind = "own_devices:Arm"\n', encoding="utf-8"
    )
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    assert push(elsewhere, "config", "check", str(folder / "mine.toml")).code == 0
    assert push(elsewhere, "config", "check", "emulated", "--set", "arm.kind=own_devices:Arm").code == 2


MODULE = """
from robot_io.driver import DriverBase, SensorFacts
class NoEmulator(DriverBase):
    facts = SensorFacts((300.0,) * 6, 100.0, (0.01,) * 6, (1.0,) * 6, "made up")
    def open(self): ...
    def start(self): ...
    def drain(self): return ()
    def health(self): ...
    def stop(self): ...
    def close(self): ...
    def fileno(self): return -1
class Whole(NoEmulator):
    Emulator = object
class NoFacts(Whole):
    facts = {"rate_hz": 100.0}
class Slow(Whole):
    facts = SensorFacts((300.0,) * 6, 49.0, (0.01,) * 6, (1.0,) * 6, "made up")
class Endless(Whole):
    facts = SensorFacts((float("inf"),) * 6, 100.0, (0.01,) * 6, (1.0,) * 6, "made up")
class Silent(Whole):
    facts = SensorFacts((300.0,) * 6, 100.0, (0.01,) * 6, (0.0,) * 6, "made up")
class Weak(Whole):
    facts = SensorFacts((300.0, 300.0, 100.0, 30.0, 30.0, 30.0), 100.0, (0.01,) * 6, (1.0,) * 6, "made up")
"""


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("robotic-ft300", "Did you mean `robotiq-ft300`?"),
        ("absent_module:Sensor", "cannot be imported: ModuleNotFoundError"),
        ("kinds:Absent", "cannot be imported: AttributeError"),
        ("kinds:SensorFacts", "lacks `from_rig`, `open`"),
        ("broken:Sensor", "cannot be imported: SyntaxError"),
        ("raising:Sensor", "cannot be imported: ZeroDivisionError"),
        ("leaving:Sensor", "importing `leaving:Sensor` ended with code 7"),
        ("kinds:NoFacts", "are not SensorFacts"),
        ("kinds:Slow", "declares 49 Hz"),
        ("kinds:Endless", "not finite"),
        ("kinds:Silent", "is not above 0"),
        ("kinds:Weak", "limits.max_force_N = 150 is above 90 N"),
        ("kinds:NoEmulator", "names no emulator"),
        ("os:path", "is not a class"),
    ],
)
def test_a_kind_that_cannot_be_used_is_one_sentence_and_opens_nothing(folder, kind, says):
    (folder / "kinds.py").write_text(MODULE, encoding="utf-8")
    (folder / "broken.py").write_text("class Sensor(:\n", encoding="utf-8")
    (folder / "raising.py").write_text("1 / 0\n", encoding="utf-8")
    (folder / "leaving.py").write_text("import os\nos._exit(7)\n", encoding="utf-8")
    done = push(folder, "run", "emulated", "--set", f"ft.kind={kind}", "--out", "out", "--json")
    assert done.code == 2, done.err
    assert says in done.err
    assert "Traceback" not in done.err
    assert len(done.err.splitlines()) == 1, done.err
    assert not (folder / "out").exists()
    assert done.last_object["error"]["code"] == 2


@pytest.mark.parametrize("device", ["arm=own_devices:Arm", "base=own_devices:Base"])
def test_level_sim_has_no_arm_or_base_of_ones_own(folder, device):
    name, _, kind = device.partition("=")
    done = push(folder, "run", "sim", "--set", f"{name}.kind={kind}", "--fast")
    assert done.code == 2
    assert "cannot be simulated at level sim" in done.err


def test_opening_a_log_imports_nothing_that_it_names(folder):
    (folder / "telltale.py").write_text(
        'import pathlib\npathlib.Path("imported").touch()\nfrom own_devices import Arm\n', encoding="utf-8"
    )
    kind = ("--set", "arm.kind=telltale:Arm")
    assert push(folder, "run", "emulated", *kind, "--distance-m", "0.1", "--out", "out", *QUICK).code == 0
    (folder / "imported").unlink()
    for argv in (
        ("replay", "out"),
        ("replay", "out", "--what-if", "control.k_f=0.2"),
        ("report", "out"),
        ("log", "info", "out"),
        ("log", "export", "out", "--out", "csv"),
    ):
        assert push(folder, *argv).code == 0, argv
        assert not (folder / "imported").exists(), argv
