"""What becomes of a test that this machine keeps from measuring."""

import pytest

from tests.host_watch import HostStalled, Unmeasured, repeated_when_the_host_stalls


@pytest.fixture
def unmeasured(monkeypatch):
    """What the test below adds is not listed as unmeasured itself."""
    own = Unmeasured()
    monkeypatch.setattr("tests.host_watch.UNMEASURED", own)
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
