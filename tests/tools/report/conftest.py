"""Short runs at level sim, made once for all tests of reports."""

import pytest

from tests.push_runs import finished

SHORT = ("run", "sim", "--fast", "--distance-m", "0.3", "--no-report")


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """A folder with the runs `one` and `two` (seeds 1 and 2), `open` (open loop) and `turned` (along another path)."""
    folder = tmp_path_factory.mktemp("runs")
    others = {
        "one": ("--seed", "1"),
        "two": ("--seed", "2"),
        "open": ("--seed", "1", "--law", "open-loop"),
        "turned": ("--seed", "1", "--set", "path.direction_deg=20"),
    }
    for name, options in others.items():
        ended = finished(folder / "state", *SHORT, *options, "--out", str(folder / name))
        assert ended.code == 0, ended.err
    return folder
