"""What becomes of a test that this machine keeps from measuring."""

import contextlib
import signal
from pathlib import Path

import pytest

from tests.faults.kill_rounds import Round, within
from tests.host_watch import HostStalled, Unmeasured, repeated_when_the_host_stalls


@pytest.fixture
def unmeasured(monkeypatch):
    """What the test below adds is not listed as unmeasured itself."""
    own = Unmeasured()
    monkeypatch.setattr("tests.host_watch.UNMEASURED", own)
    monkeypatch.setattr("tests.faults.kill_rounds.UNMEASURED", own)
    return own


def spoilt(attempts: int):
    """Return a test that the host spoils so many times, and the folders it was given."""
    folders = []

    @repeated_when_the_host_stalls
    def measure(tmp_path):
        folders.append(tmp_path)
        if len(folders) <= attempts:
            raise HostStalled("planted by a test")

    return measure, folders


def test_the_third_repeat_may_still_measure_it(tmp_path, unmeasured):
    measure, folders = spoilt(3)
    measure(tmp_path=tmp_path)
    assert len(set(folders)) == 4
    assert unmeasured.take() == []


def test_what_no_repeat_measured_is_reported_and_not_passed(tmp_path, unmeasured):
    measure, folders = spoilt(4)
    with pytest.raises(pytest.skip.Exception, match="unmeasured"):
        measure(tmp_path=tmp_path)
    assert len(folders) == 4
    assert unmeasured.take() == ["measure"]
    assert unmeasured.take() == []


def test_where_everything_has_to_be_measured_it_fails(tmp_path, unmeasured):
    unmeasured.fails = True
    measure, _ = spoilt(4)
    with pytest.raises(AssertionError, match="stalled in each of 4 attempts"):
        measure(tmp_path=tmp_path)


def test_any_other_failure_is_not_repeated(tmp_path, unmeasured):
    folders = []

    @repeated_when_the_host_stalls
    def measure(tmp_path):
        folders.append(tmp_path)
        assert False  # noqa: B011, PT015 - a test that fails

    with pytest.raises(AssertionError):
        measure(tmp_path=tmp_path)
    assert len(folders) == 1
    assert unmeasured.take() == []


def struck(monkeypatch, zero_ms, rest_ms, stall_ms=50.0):
    """Kill nothing: each round says the same. The bounds are 20 ms for the zero, and 60 ms from there to rest."""
    found = Round(None, Path(), zero_ms, rest_ms, stall_ms, 500.0, 500.0, 0)
    monkeypatch.setattr("tests.faults.kill_rounds.strike", lambda *_: found)
    assert within(Path(), Path(), "gate", signal.SIGKILL, None, zero_ms=20.0, rest_ms=60.0) is found


def test_a_round_within_its_bounds_is_measured_however_the_host_did(monkeypatch, unmeasured):
    struck(monkeypatch, 20.0, 80.0)
    assert unmeasured.take() == []


@pytest.mark.parametrize(("measure_all", "rounds"), [(False, 1), (True, 4)])
def test_a_round_that_the_host_stalled_is_repeated_where_everything_is_measured(
    monkeypatch, unmeasured, measure_all, rounds
):
    unmeasured.fails = measure_all
    struck_at = []
    found = Round(None, Path(), 99.0, 140.0, 50.0, 500.0, 500.0, 0)
    monkeypatch.setattr("tests.faults.kill_rounds.strike", lambda *words: struck_at.append(words) or found)
    failed = pytest.raises(AssertionError, match="not measured") if measure_all else contextlib.nullcontext()
    with failed:
        within(Path(), Path(), "gate", signal.SIGKILL, None, zero_ms=20.0, rest_ms=60.0)
    assert len(struck_at) == rounds


def test_bounds_that_no_round_could_measure_are_reported_and_the_order_is_judged(monkeypatch, unmeasured):
    struck(monkeypatch, 99.0, 140.0)
    assert unmeasured.take() == ["SIGKILL of gate: zero within 20.0 ms, rest within 60.0 ms"]
    for zero_ms, rest_ms in ((99.0, 90.0), (None, 90.0), (99.0, None)):
        with pytest.raises(AssertionError):
            struck(monkeypatch, zero_ms, rest_ms)


def test_a_round_that_the_host_did_not_stall_is_judged_by_its_bounds(monkeypatch, unmeasured):
    with pytest.raises(AssertionError, match="bounds"):
        struck(monkeypatch, 21.0, 60.0, stall_ms=9.0)
    assert unmeasured.take() == []
