"""Before a real robot moves: doctor, then one question on a terminal. The robot here is emulated behind loopback."""

import contextlib
import os
import pty
import re

import pytest

from tests.forked_push import forked
from tests.push_runs import QUICK, finished, one_error, started
from tools.doctor.emulated import emulators
from tools.places.device_locks import DeviceLocks
from tools.rig import resolve_rig

QUESTION = r"Push now\? \[y/N\]"


@contextlib.contextmanager
def robot(tmp_path, *faults, devices=("ft", "arm", "base")):
    """Serve a robot, and give a rig file in which these devices are real ones at its addresses."""
    with emulators(resolve_rig("emulated"), "", faults) as served:
        addresses = {"ft": ("port", served.ft.port), "arm": ("host", served.arm.host), "base": ("url", served.base.url)}
        tables = [
            f'[{device}]\nlevel = "hardware"\n{key} = "{address}"'
            for device, (key, address) in addresses.items()
            if device in devices
        ]
        rig = tmp_path / "real.toml"
        rig.write_text('extends = "emulated"\nname = "real"\n' + "\n".join(tables))
        yield str(rig)


@contextlib.contextmanager
def terminal(typed):
    """Give a terminal's descriptor on which something has been typed already."""
    master, slave = pty.openpty()
    os.write(master, typed.encode())
    try:
        yield slave
    finally:
        os.close(slave)
        os.close(master)


def test_a_failed_check_refuses(state, tmp_path):
    out = tmp_path / "out"
    with robot(tmp_path, "arm.protective-stop", devices=["arm"]) as rig:
        ended = forked(state, "run", rig, "--move-robot", "--yes", "--out", str(out), "--json")
    error = one_error(ended, 4)
    assert "stopped by safety" in error["what"]
    assert error["where"].startswith("ur10 127.")
    assert "teach pendant" in error["do"]
    assert re.search(r"^failed +arm\.safety", ended.err, re.MULTILINE)
    assert not out.exists()


@pytest.mark.long
def test_rows_of_a_device_that_a_run_holds_are_skipped_and_say_by_whom(state, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(state))
    with robot(tmp_path, devices=["arm"]) as rig, DeviceLocks(resolve_rig(rig)):
        told = finished(state, "doctor", rig, "--json").last_object
    rows = [check for check in told["checks"] if check["check"].startswith("arm.")]
    assert {check["result"] for check in rows} == {"skipped"}
    assert all(f"process {os.getpid()}, rig 'real'" in check["evidence"] for check in rows)
    assert any(check["result"] == "ok" for check in told["checks"] if check["check"].startswith("base."))


@pytest.mark.parametrize("real", [True, False])
def test_dry_run_connects_to_nothing_and_lists_the_checks(state, real):
    ended = forked(state, "run", "thing" if real else "emulated", "--dry-run", "--json")
    assert ended.code == 0
    told = ended.last_object
    assert ("ft.latency-timer" in told["checks"]) is real
    assert told["bounds"]["stopping"]["stop_m"] > 0.0
    assert told["resolved"]["control"]["k_f"] == 0.3
    assert "stopping distance" in ended.err
    assert "nothing was opened" in ended.err


@pytest.mark.long
@pytest.mark.parametrize("json", [True, False])
def test_on_a_terminal_it_asks_once_and_no_is_no(state, tmp_path, json):
    out = tmp_path / "out"
    with robot(tmp_path) as rig, terminal("n\n") as stdin:
        argv = ("run", rig, "--move-robot", "--out", str(out), *(["--json"] if json else []))
        ended = finished(state, *argv, stdin=stdin)
    assert ended.code == 130, ended.err
    assert len(re.findall(QUESTION, ended.err)) == 1
    before = ended.err[: re.search(QUESTION, ended.err).start()]
    assert "stopping distance at 0.1 m/s" in before
    for name in ("rig.calibration-age", "base.timeout"):
        assert re.search(rf"^warning +{re.escape(name)}", before, re.MULTILINE)
    assert not out.exists()


@pytest.mark.long
@pytest.mark.parametrize(("yes", "asked"), [([], 1), (["--yes"], 0)])
def test_yes_goes_on(state, tmp_path, yes, asked):
    """Every key typed after the answer would stop the push: it ends by the one that is."""
    with robot(tmp_path) as rig, terminal("y\n" if asked else "") as stdin:
        argv = ("run", rig, "--move-robot", *yes, *QUICK, "--distance-m", "5", "--out", str(tmp_path / "out"))
        with started(state, *argv, stdin=stdin) as run:
            run.wait_for("TARE|APPROACH|PUSH")
            run.signal(2)
            ended = run.wait()
    assert ended.code == 130, ended.err
    assert len(re.findall(QUESTION, ended.err)) == asked


@pytest.mark.long
def test_without_a_terminal_nothing_asks(state, tmp_path):
    with robot(tmp_path) as rig:
        argv = ("run", rig, "--move-robot", *QUICK, "--distance-m", "0.1", "--out", str(tmp_path / "out"), "--json")
        ended = finished(state, *argv)
    assert "[y/N]" not in ended.err
    assert ended.last_object["level"] == "hardware"
    assert ended.code in (0, 9), ended.err


@pytest.mark.long
def test_check_is_doctor_and_the_lines_of_a_dry_run(state, tmp_path):
    with robot(tmp_path, "base.battery=19") as rig:
        ended = finished(state, "run", rig, "--check", "--json")
    assert ended.code == 4
    told = ended.last_object
    assert [c["check"] for c in told["doctor"]["checks"] if c["result"] == "failed"] == ["base.battery"]
    assert "stopping distance at 0.1 m/s" in ended.err
    assert "would push 2 m" in ended.err
