"""Which run is attached to, and which devices are opened."""

import os

import pytest
from msgspec.structs import replace

from tools.places import running
from tools.places.running import announced
from tools.rig import resolve_rig
from tools.watch.find_run import run_to_watch
from tools.watch.own_devices import OwnDevices
from tools.watch.seen import Link, Seen


@pytest.fixture
def state_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def real(url):
    return resolve_rig("emulated", ["base.level=hardware", f"base.url={url}"])


def test_a_run_of_the_same_rig_is_found_while_it_is_under_way(state_folder):
    log = state_folder / "run.mcap"
    log.touch()
    rig, other = resolve_rig("emulated"), resolve_rig("sim")
    with announced(rig, log):
        found = run_to_watch(rig)
        assert found is not None
        assert (found.log, found.alive()) == (str(log), ["launcher"])
        assert run_to_watch(other) is None
    assert run_to_watch(rig) is None


def test_with_real_devices_these_count_and_not_the_name(state_folder):
    log = state_folder / "run.mcap"
    log.touch()
    one, other = real("ws://127.0.0.1:7001"), real("ws://127.0.0.1:7002")
    with announced(one, log):
        assert run_to_watch(replace(one, name="renamed")) is not None
        assert run_to_watch(other) is None


def test_a_run_that_has_no_log_yet_is_not_attached_to(state_folder):
    rig = resolve_rig("emulated")
    with announced(rig, state_folder / "run.mcap"):
        assert run_to_watch(rig) is None


def test_a_run_that_cannot_be_written_down_runs_all_the_same(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    (tmp_path / "file").touch()
    with announced(resolve_rig("sim"), tmp_path / "run.mcap"):
        assert os.getpid()
    with pytest.raises(Exception, match="state folder"):
        running._folder()


def test_devices_that_others_hold_or_made_are_left_alone_and_named():
    rig = resolve_rig("emulated")
    rig = replace(rig, base=replace(rig.base, kind="their.robot:Base"))
    with OwnDevices(rig, "", {"ft": "process 7, rig 'thing'", "arm": "process 7, rig 'thing'"}) as devices:
        seen = Seen(rig)
        for report in devices.read():
            seen.take_device(report)
    assert seen.links["ft"] == Link("not watched", "in use by process 7, rig 'thing'")
    assert seen.links["base"].state == "not watched"
    assert "their.robot:Base" in seen.links["base"].cause
