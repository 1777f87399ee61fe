"""Devices of another maker in a run: an arm and a base over UDP, and everything a kind can get wrong."""

from __future__ import annotations

import re
import shutil
from functools import partial
from pathlib import Path

import pytest

from robot_io.mcap.read import read_log
from robot_io.tick import TICK_CDR
from tests.forked_push import forked
from tests.how_many import mostly_long
from tests.push_runs import QUICK, pushed

OWN = Path(__file__).with_name("own_devices.py")


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "mine"
    path.mkdir()
    shutil.copy(OWN, path)
    return path


@pytest.fixture
def push(host):
    return partial(pushed, host=host)


@pytest.fixture
def refused(state):
    """Run what ends before a base moves."""
    return lambda folder, *argv: forked(state, *argv, cwd=folder)


@pytest.mark.long
@pytest.mark.parametrize("device", ["arm=own_devices:Arm", "base=own_devices:Base"])
def test_a_push_with_an_arm_or_base_of_ones_own_replays(push, folder, device):
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


@pytest.mark.long
def test_an_arm_that_says_it_may_be_moved_stops_the_push(push, folder):
    done = push(
        folder, "run", "emulated", "--set", "arm.kind=own_devices:Arm", "--set", "arm.options.free_after=300",
        "--distance-m", "1", "--out", "out", "--json", *QUICK, stopped_by="F27",
    )  # fmt: skip
    assert done.code == 5, done.err
    assert done.last_object["faults"] == ["F27"]


def test_beside_the_rig_file_it_is_found_from_anywhere(refused, folder, tmp_path):
    (folder / "mine.toml").write_text(
        'extends = "emulated"\nname = "mine"\n[arm]\nkind = "own_devices:Arm"\n', encoding="utf-8"
    )
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    assert refused(elsewhere, "config", "check", str(folder / "mine.toml")).code == 0
    assert refused(elsewhere, "config", "check", "emulated", "--set", "arm.kind=own_devices:Arm").code == 2


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
        ("absent_module:Sensor", "Put its folder on PYTHONPATH"),
        ("kinds:Absent", "cannot be imported: AttributeError"),
        ("kinds:Absent", "Correct the module, or the name of its class"),
        ("kinds:SensorFacts", "lacks `from_rig`, `open`"),
        ("broken:Sensor", "cannot be imported: SyntaxError"),
        ("raising:Sensor", "cannot be imported: ZeroDivisionError"),
        ("leaving:Sensor", "importing `leaving:Sensor` ended with code 7"),
        ("kinds:NoFacts", "are not SensorFacts"),
        ("kinds:Slow", "declares 49 Hz"),
        ("kinds:Endless", "not finite"),
        ("kinds:Silent", "is not above 0"),
        ("kinds:Weak", "limits.max_force_N = 150 is above 90 N"),
        ("kinds:NoEmulator", "has no emulator"),
        ("os:path", "is not a class"),
    ],
)
def test_a_kind_that_cannot_be_used_is_one_sentence_and_opens_nothing(refused, folder, kind, says):
    (folder / "kinds.py").write_text(MODULE, encoding="utf-8")
    (folder / "broken.py").write_text("class Sensor(:\n", encoding="utf-8")
    (folder / "raising.py").write_text("1 / 0\n", encoding="utf-8")
    (folder / "leaving.py").write_text("import os\nos._exit(7)\n", encoding="utf-8")
    done = refused(folder, "run", "emulated", "--set", f"ft.kind={kind}", "--out", "out", "--json")
    assert done.code == 2, done.err
    assert says in done.err
    assert "Traceback" not in done.err
    assert len(done.err.splitlines()) == 1, done.err
    assert not (folder / "out").exists()
    assert done.last_object["error"]["code"] == 2


SENSORS = """
import time
from udp_sensor import UdpSensor
from msgspec.structs import replace
class Constructor(UdpSensor):
    @classmethod
    def from_rig(cls, address, options):
        raise TypeError("planted")
class Opening(UdpSensor):
    def open(self):
        raise OSError("planted")
class Draining(UdpSensor):
    def drain(self):
        if self.packets_ok > 2500:
            raise ZeroDivisionError("planted")
        return super().drain()
class Uncounted(UdpSensor):
    def health(self):
        return replace(super().health(), counters={})
class Ahead(UdpSensor):
    def drain(self):
        samples = super().drain()
        if self.packets_ok > 2500:
            return ()
        return tuple(replace(s, received_ns=s.received_ns + 3_000_000_000) for s in samples)
class WallClock(UdpSensor):
    def drain(self):
        return tuple(replace(s, received_ns=time.time_ns()) for s in super().drain())
"""


@pytest.fixture
def sensors(folder):
    page = (OWN.parents[3] / "docs/add-a-device.md").read_text(encoding="utf-8")
    for name, code in zip(("udp_sensor", "udp_emulator"), re.findall(r"```python\n(.*?)```", page, re.S), strict=True):
        (folder / f"{name}.py").write_text(code, encoding="utf-8")
    (folder / "sensors.py").write_text(SENSORS, encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("kind", "code", "says"),
    [
        pytest.param("Constructor", 2, "its driver failed: TypeError: planted", marks=pytest.mark.long),
        ("Opening", 4, "its driver failed: OSError: planted"),
    ],
)
def test_what_a_driver_should_not_raise_names_the_driver(refused, sensors, kind, code, says):
    done = refused(sensors, "run", "emulated", "--set", f"ft.kind=sensors:{kind}", "--out", "out", "--json")
    assert done.code == code, done.err
    assert says in done.last_object["error"]["what"]
    assert f"sensors:{kind}" in done.err
    assert "defect of the program" not in done.err


@pytest.mark.long
def test_a_driver_that_raises_in_mid_push_stops_it_and_the_log_says_so(push, sensors):
    done = push(
        sensors, "run", "emulated", "--set", "ft.kind=sensors:Draining", "--distance-m", "2", "--out", "out", "--json",
        *QUICK, stopped_by="F68",
    )  # fmt: skip
    assert done.code != 0
    assert "F68" in done.last_object["faults"]
    assert "ZeroDivisionError: planted" in " ".join(done.last_object["notes"])
    assert push(sensors, "replay", "out").code == 0


@pytest.mark.long
@pytest.mark.parametrize("kind", ["Uncounted", "WallClock"])
def test_a_driver_that_counts_nothing_or_stamps_by_the_wall_clock_still_pushes(push, sensors, kind):
    done = push(
        sensors, "run", "emulated", "--set", f"ft.kind=sensors:{kind}", "--distance-m", "0.1", "--out", "out", "--json",
        *QUICK,
    )  # fmt: skip
    assert (done.code, done.last_object["verdict"]) == (0, "done"), done.err
    assert push(sensors, "replay", "out").code == 0


@pytest.mark.long
def test_stamps_from_the_future_do_not_hide_a_silent_sensor(push, sensors):
    """Silent after two and a half seconds, while it pushes: within 160 ms the run stops, not three seconds later."""
    done = push(
        sensors, "run", "emulated", "--set", "ft.kind=sensors:Ahead", "--distance-m", "2", "--out", "out", "--json",
        *QUICK, stopped_by="F01-stop",
    )  # fmt: skip
    assert done.code == 5, done.err
    assert "F01-stop" in done.last_object["fault_counts"]
    log = read_log(sensors / "out" / "run.mcap")
    ticks = [TICK_CDR.decode(message.payload) for message in log if message.topic == "/control/tick"]
    newest_ns = max(reading.received_ns for tick in ticks for reading in tick.input.ft.readings)
    stopped_ns = min(tick.input.now_ns for tick in ticks if "F01-stop" in tick.output.faults)
    assert 0 < stopped_ns - newest_ns < 200_000_000


def test_a_base_without_its_attributes_is_refused(refused, folder):
    (folder / "bare.py").write_text(
        "from own_devices import Base\nclass Bare(Base):\n    def __init__(self, address):\n"
        "        super().__init__(address)\n        del self.sent_ns\n",
        encoding="utf-8",
    )
    done = refused(folder, "run", "emulated", "--set", "base.kind=bare:Bare", "--out", "out", "--json")
    assert done.code == 2, done.err
    assert "lacks `sent_ns`" in done.err


@pytest.mark.parametrize(
    "device", mostly_long(("arm=own_devices:Arm", "base=own_devices:Base"), "base=own_devices:Base")
)
def test_level_sim_has_no_arm_or_base_of_ones_own(refused, folder, device):
    name, _, kind = device.partition("=")
    done = refused(folder, "run", "sim", "--set", f"{name}.kind={kind}", "--fast")
    assert done.code == 2
    assert "cannot be simulated at level sim" in done.err


@pytest.mark.long
def test_opening_a_log_imports_nothing_that_it_names(push, folder):
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
