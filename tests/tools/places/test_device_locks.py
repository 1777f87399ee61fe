"""One run at a time for each real device, however its address is written and whatever the rig is called."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from robot_io.errors import EnvironmentFault
from tools.places.device_locks import DeviceLocks, FreeDevices, resources_of
from tools.places.state_dir import state_dir
from tools.rig import resolve_rig

ROOT = Path(__file__).resolve().parents[3]
HOLDER = """
import sys
from tools.places.device_locks import DeviceLocks
from tools.rig import resolve_rig
with DeviceLocks(resolve_rig("emulated", sys.argv[1:])):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def port():
    master, slave = pty.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


def rig(name, *, ft=None, arm=None, base=None):
    overrides = [f"name={name}"]
    for key, address in (("ft.port", ft), ("arm.host", arm), ("base.url", base)):
        if address is not None:
            overrides += [f"{key}={address}", f"{key.split('.')[0]}.level=hardware"]
    return resolve_rig("emulated", overrides)


def refused(held, asked):
    """Return the refusal of the second rig while the first is held."""
    with DeviceLocks(held), pytest.raises(EnvironmentFault, match="in use by another run") as caught:
        DeviceLocks(asked)
    with DeviceLocks(asked):  # free again
        pass
    return caught.value


def test_two_rigs_with_one_base_exclude_each_other():
    held, asked = rig("a", base="ws://127.0.0.1:9090"), rig("b", base="ws://127.0.0.1:9090/other?way=1")
    error = refused(held, asked)
    assert error.where == "ws://127.0.0.1:9090/other?way=1"
    assert f"process {os.getpid()}, rig 'a'" in error.what


@pytest.mark.parametrize("other", ["ws://localhost:9090", "ws://127.1:9090", "ws://[::ffff:127.0.0.1]:9090"])
def test_an_address_is_the_same_however_it_is_written(other):
    refused(rig("a", base="ws://127.0.0.1:9090"), rig("b", base=other))


def test_a_secure_address_has_the_port_of_its_scheme():
    refused(rig("a", base="wss://127.0.0.1"), rig("b", base="ws://127.0.0.1:443"))


def test_one_arm_and_one_port_are_enough(port, tmp_path):
    refused(rig("a", arm="127.0.0.77"), rig("b", arm="127.0.0.77", base="ws://127.0.0.1:1"))
    link = tmp_path / "sensor"
    link.symlink_to(port)
    refused(rig("a", ft=port), rig("b", ft=str(link)))
    refused(rig("a", ft="socket://127.0.0.1:7"), rig("b", ft="socket://localhost:7"))


def test_different_devices_do_not_disturb_each_other(port):
    with DeviceLocks(rig("same", base="ws://127.0.0.1:9090", arm="127.0.0.77")):
        for free in (
            rig("same", base="ws://127.0.0.1:9091"),
            rig("same", base="ws://127.0.0.2:9090"),
            rig("same", arm="127.0.0.78", ft=port),
        ):
            with DeviceLocks(free):
                pass


def test_emulated_devices_need_no_lock():
    assert resources_of(rig("emulated")) == []
    with DeviceLocks(rig("emulated")), DeviceLocks(rig("emulated")):
        pass


def test_a_name_that_nobody_knows_is_left_to_its_driver():
    nowhere = rig("a", base="ws://nosuchhost.invalid:9090")
    refused(nowhere, rig("b", base="ws://nosuchhost.invalid:9090"))


def test_a_refused_rig_lets_go_of_what_it_had_got():
    with DeviceLocks(rig("a", base="ws://127.0.0.1:9090")):
        with pytest.raises(EnvironmentFault):
            DeviceLocks(rig("b", arm="127.0.0.77", base="ws://127.0.0.1:9090"))
        with DeviceLocks(rig("c", arm="127.0.0.77")):
            pass


def test_a_lock_is_held_across_processes_and_freed_by_a_kill():
    settings = ["name=theirs", "base.level=hardware", "base.url=ws://127.0.0.1:9090"]
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, *settings],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    with holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(EnvironmentFault, match=f"process {holder.pid}, rig 'theirs'"):
            DeviceLocks(rig("ours", base="ws://127.0.0.1:9090"))
        holder.kill()
        holder.wait()
        with DeviceLocks(rig("ours", base="ws://127.0.0.1:9090")):
            pass


def test_its_file_is_the_users_own():
    with DeviceLocks(rig("a", arm="127.0.0.77")):
        (lock,) = state_dir().glob("*.lock")
        assert lock.stat().st_mode & 0o777 == 0o600


def test_a_lock_that_cannot_be_opened_is_said():
    with DeviceLocks(rig("a", arm="127.0.0.77")):
        (lock,) = state_dir().glob("*.lock")
    lock.unlink()
    lock.mkdir()
    with pytest.raises(EnvironmentFault, match=r"\.lock: the device's lock cannot be opened"):
        DeviceLocks(rig("a", arm="127.0.0.77"))


def test_an_arm_and_its_own_sensor_have_one_lock():
    levels = ["ft.level=hardware", "arm.level=hardware", "arm.host=127.0.0.9"]
    own = resolve_rig("ur10e-emulated", levels)
    assert len({found.key for found in resources_of(own)}) == 1
    assert "127.0.0.9" in str(refused(own, rig("arm-only", arm="127.0.0.9")))
    with DeviceLocks(rig("arm-only", arm="127.0.0.9")), FreeDevices(own) as free:
        assert set(free.held) == {"ft", "arm"}
