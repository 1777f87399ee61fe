"""A tare kept for `--start-in-contact` counts for the same rig, in the same power cycle, for half a day."""

import time

import pytest

from robot_io.errors import UsageError
from tools.places import saved_tare
from tools.places.saved_tare import MAX_AGE_S
from tools.rig import resolve_rig

BIAS = (-20.5, 21.0, -48.25, -0.1, 1.2, -0.3)
JOINTS = (1.57, -0.17, 1.57, -1.4, 1.57, 1.31)


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def passes(monkeypatch, seconds: float) -> None:
    now_s = time.time()
    monkeypatch.setattr(saved_tare.time, "time", lambda: now_s + seconds)


@pytest.mark.parametrize("age_s", [0.0, MAX_AGE_S - 60.0])
def test_it_comes_back_as_it_was(monkeypatch, age_s):
    rig = resolve_rig("sim")
    saved_tare.save(rig, BIAS, JOINTS)
    passes(monkeypatch, age_s)
    loaded = saved_tare.load(rig)
    assert (loaded.bias, loaded.joints) == (BIAS, JOINTS)


@pytest.mark.parametrize("age_s", [MAX_AGE_S + 60.0, -60.0])
def test_an_old_one_does_not_count_nor_one_of_the_future(monkeypatch, age_s):
    rig = resolve_rig("sim")
    saved_tare.save(rig, BIAS, JOINTS)
    passes(monkeypatch, age_s)
    with pytest.raises(UsageError, match="--start-in-contact needs a tare"):
        saved_tare.load(rig)


@pytest.mark.parametrize("change", ["world.sensor.tool_mass_kg=0.7", "frames.sensor_in_base_m=[0.8, 0.0, 0.15]"])
def test_another_sensor_or_mounting_is_another_power_cycle(change):
    saved_tare.save(resolve_rig("sim"), BIAS, JOINTS)
    with pytest.raises(UsageError):
        saved_tare.load(resolve_rig("sim", [change]))


def test_a_sensor_of_another_kind_is_another_sensor(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(
        "from robot_io.driver import SensorFacts\nfrom robot_io.ft300.driver import Ft300\n"
        "class Mine(Ft300):\n    Emulator = object\n",
        encoding="utf-8",
    )
    monkeypatch.chdir(tmp_path)
    mine = "ft.kind=mine:Mine"
    saved_tare.save(resolve_rig("emulated", [mine]), BIAS, JOINTS)
    assert saved_tare.load(resolve_rig("emulated", [mine])).bias == BIAS
    for other in ([], [mine, "ft.options.gain=2"]):
        with pytest.raises(UsageError):
            saved_tare.load(resolve_rig("emulated", other))


def test_a_real_sensor_is_known_by_its_port_and_this_boot():
    here = resolve_rig("thing")
    assert saved_tare.power_cycle(here) == saved_tare.power_cycle(resolve_rig("thing", ["control.k_f=0.1"]))
    assert saved_tare.power_cycle(here) != saved_tare.power_cycle(resolve_rig("thing", ["ft.port=/dev/ttyUSB1"]))


def test_another_rig_or_a_damaged_file_has_none(state):
    saved_tare.save(resolve_rig("sim"), BIAS, JOINTS)
    with pytest.raises(UsageError):
        saved_tare.load(resolve_rig("emulated"))
    [file] = state.rglob("*.tare.json")
    file.write_bytes(file.read_bytes()[:20])
    with pytest.raises(UsageError):
        saved_tare.load(resolve_rig("sim"))
