"""A report made from the log alone: a world that fell silent tells that the emulators died."""

from dataclasses import replace

import pytest

from tests.forked_push import forked
from tests.tools.report.conftest import SHORT
from tools.report.run_data import read_run
from tools.report.run_verdict import verdict


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """The log of a run whose sensor fell silent after 4 s, the world going on."""
    folder = tmp_path_factory.mktemp("stopped")
    ended = forked(folder / "state", *SHORT, "--fault", "ft.off at 4 s", "--out", str(folder / "run"))
    assert ended.code == 5, ended.err
    return read_run(folder / "run" / "run.mcap")


def test_the_row_of_the_device_is_the_cause_while_the_world_goes_on(stopped):
    assert stopped.world_end_s == pytest.approx(stopped.duration_s, abs=0.05)
    assert verdict(stopped, {}).first_fault == "F01-stop"


def test_a_world_that_ended_with_the_device_is_the_cause(stopped):
    found = verdict(replace(stopped, world_end_s=4.0), {})
    assert found.first_fault == "emulators"
    assert "the emulators have ended, and with them every emulated device" in found.why
