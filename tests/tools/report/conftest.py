"""Short runs at level sim, made once for all tests of reports."""

import pytest

from tests.forked_push import forked
from tests.made_once import made_once
from tests.push_runs import FAST_TARE

SHORT = ("run", "sim", "--fast", "--distance-m", "0.3", "--no-report", *FAST_TARE)


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """A folder with the runs `one` and `two` (seeds 1 and 2), `open` (open loop) and `turned` (along another path)."""
    return made_once(tmp_path_factory, "runs", _make)


def _make(folder):
    others = {
        "one": ("--seed", "1"),
        "two": ("--seed", "2"),
        "open": ("--seed", "1", "--law", "open-loop"),
        "turned": ("--seed", "1", "--set", "path.direction_deg=20"),
    }
    for name, options in others.items():
        ended = forked(folder / "state", *SHORT, *options, "--out", str(folder / name))
        assert ended.code == 0, ended.err
    return folder
