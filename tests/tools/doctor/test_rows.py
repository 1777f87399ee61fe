"""Rows that no emulator can cause: a forbidden port, a timer that the system names, this machine, the rig."""

import os
import pty
import resource
import shutil
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from subprocess import PIPE
from types import SimpleNamespace

import pytest

from tools.doctor import ft_checks, host_checks
from tools.doctor.ft_checks import openers
from tools.doctor.host_checks import host_checks as check_host
from tools.doctor.rig_checks import rig_checks
from tools.rig import resolve_rig


def by_name(checks):
    return {check.check: check for check in checks}


@pytest.fixture
def port():
    master, slave = pty.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


def sensor_at(port):
    return resolve_rig("emulated", ["ft.level=hardware", f"ft.port={port}"])


def test_a_port_that_may_not_be_opened(port, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    rows = by_name(ft_checks.ft_checks(sensor_at(port)))
    assert rows["ft.permission"].result == "failed"
    assert "dialout" in rows["ft.permission"].fix
    assert rows["ft.identity"].result == "skipped"


def test_a_port_that_is_no_device(tmp_path):
    (tmp_path / "file").touch()
    assert by_name(ft_checks.ft_checks(sensor_at(tmp_path / "file")))["ft.port"].result == "failed"


@pytest.mark.parametrize(("told_ms", "result"), [(1, "ok"), (16, "warning")])
def test_a_timer_that_the_system_names_is_believed(port, monkeypatch, told_ms, result):
    monkeypatch.setattr(ft_checks, "latency_timer_ms", lambda _port: told_ms)
    rows = ft_checks.Rows("ft")
    ft_checks._latency(rows, port, None, None)
    row = by_name(rows.all(""))["ft.latency-timer"]
    assert (row.result, row.value, row.limit, row.unit) == (result, float(told_ms), 1.0, "ms")
    assert ("udev" in row.fix) is (result == "warning")


def host(monkeypatch, **overrides):
    settings = [f"loop.rate_hz={overrides.pop('rate_hz', 100)}"]
    return by_name(check_host(resolve_rig("emulated", settings)))


@pytest.mark.parametrize(("rate_hz", "result"), [(100, "warning"), (250, "failed")])
def test_without_real_time_only_100_hz(monkeypatch, rate_hz, result):
    monkeypatch.setattr(host_checks, "try_realtime", lambda _priority: False)
    assert host(monkeypatch, rate_hz=rate_hz)["host.scheduling"].result == result


def test_too_few_files(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (64, 64))
    assert host(monkeypatch)["host.limits"].result == "failed"


def test_a_full_disk(monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=1_000_000))
    assert host(monkeypatch)["host.disk"].result == "failed"


def test_a_machine_that_could_fall_asleep(monkeypatch, tmp_path):
    monkeypatch.setattr(host_checks, "SYSTEMD", tmp_path)
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    assert host(monkeypatch)["host.suspend"].result == "warning"


def aged(**days):
    """Return the settings that give a rig calibrations of these ages."""
    now = datetime.now(UTC)
    for what, age in days.items():
        table = f"calibration.{what}"
        yield from (f"{table}.made={(now - timedelta(days=age)).isoformat()}", f"{table}.uncertainty=1")
        yield f'{table}.unit="m"'


@pytest.mark.parametrize(
    ("settings", "check", "result"),
    [
        (["workspace.x_m=[-1.6, 0.5]", "workspace.y_m=[-1, 1]"], "rig.workspace", "failed"),
        (["workspace.x_m=[-4, 9]", "workspace.y_m=[-0.8, 0.8]"], "rig.corridor", "warning"),
        (["workspace.x_m=[-4, 9]", "workspace.y_m=[-1.5, 1.5]"], "rig.corridor", "ok"),
        (["goal.end_tolerance_m=0.6"], "rig.corridor", "warning"),
        (["control.push_speed_m_per_s=0.5"], "rig.stopping-distance", "warning"),
        (["control.k_f=0.1", "control.k_y_rad_per_m=0.3"], "rig.gains", "warning"),
        ([], "rig.gains", "ok"),
        ([], "rig.calibration-age", "warning"),
        ([*aged(frame=29, contact=2)], "rig.calibration-age", "ok"),
        ([*aged(frame=31, contact=2)], "rig.calibration-age", "warning"),
        ([*aged(frame=2)], "rig.calibration-age", "warning"),
    ],
)
def test_what_the_rig_says_of_itself(settings, check, result):
    row = by_name(rig_checks(resolve_rig("emulated", settings)))[check]
    assert row.result == result, row
    assert bool(row.fix) == (result != "ok")


def age_row(*settings):
    return by_name(rig_checks(resolve_rig("emulated", settings)))["rig.calibration-age"]


@pytest.mark.parametrize(("truth", "result"), [([], "skipped"), (["world.truth.sensor_yaw_deg=3"], "warning")])
def test_at_level_sim_the_frames_are_exact_unless_the_world_errs(truth, result):
    assert by_name(rig_checks(resolve_rig("sim", truth)))["rig.calibration-age"].result == result


def test_the_calibrations_that_are_missing_or_old_are_named():
    both = age_row()
    assert both.evidence == "never calibrated: the sensor's frame and the contact point"
    assert (both.value, both.limit, both.unit) == (None, 30.0, "days")
    one = age_row(*aged(contact=3))
    assert one.evidence == "never calibrated: the sensor's frame"
    assert round(one.value, 3) == 3.0
    tilt_only = age_row(*aged(frame=3, contact=3), "calibration.frame.unseen=yaw")  # the tool was weighed
    assert tilt_only.result == "warning"
    assert tilt_only.evidence == "never calibrated: the sensor's frame in yaw"
    old = age_row(*aged(frame=45, contact=3))
    assert old.evidence == "the sensor's frame was calibrated 45 days ago"
    assert round(old.value, 3) == 45.0
    assert age_row(*aged(frame=45, contact=3), "calibration.max_age_days=46").result == "ok"
    ahead = age_row(*aged(frame=-9, contact=3))
    assert ahead.evidence == "the calibration of the sensor's frame is dated 9 days ahead of this machine's clock"


def test_who_made_a_pty_is_no_other_reader_of_it_and_who_only_opened_it_is():
    """A proxy in front of the sensor keeps the near end of its pty open."""
    made = "import os, sys; master, near = os.openpty(); print(os.ttyname(near), flush=True); sys.stdin.read()"
    opened = (
        "import os, sys; os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY); print('open', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen([sys.executable, "-c", made], stdin=PIPE, stdout=PIPE, text=True) as maker:
        path = maker.stdout.readline().strip()
        assert openers(path) == []
        with subprocess.Popen([sys.executable, "-c", opened, path], stdin=PIPE, stdout=PIPE, text=True) as reader:
            assert reader.stdout.readline() == "open\n"
            [found] = openers(path)
            assert found.endswith(f"(process {reader.pid})")
            reader.stdin.close()
        maker.stdin.close()
