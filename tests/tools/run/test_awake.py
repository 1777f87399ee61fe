"""The hold against sleep: taken where the system offers one, released with the run, and never in its way."""

import time

import pytest

from tools.run import awake as module
from tools.run.awake import awake

TOOL = """#!/bin/sh
echo "$@" > {folder}/asked
shift 4
"$@"
touch {folder}/released
"""


@pytest.fixture
def systemd(tmp_path, monkeypatch):
    """Give the folder of a stand-in for systemd's tool; it notes what it was asked, and when it is released."""
    monkeypatch.setattr(module, "SYSTEMD", tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    tool = tmp_path / "systemd-inhibit"
    tool.write_text(TOOL.format(folder=tmp_path))
    tool.chmod(0o755)
    return tmp_path


def test_the_hold_lasts_as_long_as_the_run(systemd):
    with awake():
        deadline = time.monotonic() + 5.0
        while not (systemd / "asked").exists() or not (systemd / "asked").read_text():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert "--what=sleep --mode=block" in (systemd / "asked").read_text()
        assert not (systemd / "released").exists()
    assert (systemd / "released").exists()


def test_without_systemd_nothing_is_started(systemd, monkeypatch):
    monkeypatch.setattr(module, "SYSTEMD", systemd / "no such folder")
    with awake():
        pass
    assert not (systemd / "asked").exists()


@pytest.mark.parametrize("text", ["#!/bin/sh\nexit 1\n", "no program"])
def test_a_tool_that_fails_changes_nothing(systemd, text):
    (systemd / "systemd-inhibit").write_text(text)
    with awake():
        pass


def test_an_error_of_the_run_releases_it_too(systemd):
    with pytest.raises(RuntimeError), awake():
        raise RuntimeError
