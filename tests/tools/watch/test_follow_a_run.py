"""Following a log while it grows: what is reported of it, and how its end is told."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from robot_io.errors import LogDamaged
from robot_io.messages import LinkState
from robot_io.tick import Phase
from tools.places.running import RunningRun
from tools.rig import resolve_rig
from tools.watch.attached import rig_of_run
from tools.watch.reports import ReportSender, RunReport, report_link
from tools.watch.run_process import MOST_TICKS, NOT_WHOLE, RunFollower
from tools.watch.seen import Seen
from tools.watch.view import as_json, view_of

GOLDEN = Path(__file__).parents[2] / "golden" / "logs" / "emulated.mcap"


class GrowingRun:
    """A run whose log grows by a piece each time the reader waits; it lives until all is there."""

    def __init__(self, path, data, pieces):
        self.log = str(path)
        self._path = path
        size = -(-len(data) // pieces)
        self._pieces = [data[i : i + size] for i in range(0, len(data), size)]
        path.write_bytes(self._pieces.pop(0))

    def alive(self):
        return ["launcher"] if self._pieces else []

    def grow(self):
        with self._path.open("ab") as file:
            file.write(self._pieces.pop(0))


@pytest.fixture
def follow(monkeypatch):
    reader, far = report_link()

    def follow(run):
        reports = []

        def wait(_):
            reports.extend(reader.read())
            run.grow()

        monkeypatch.setattr("tools.watch.run_process.time.sleep", wait)
        ended = RunFollower(run, ReportSender(far), None).follow()
        return ended, reports + reader.read()

    yield follow
    reader.close()
    far.close()


def test_a_log_that_grows_is_reported_to_its_last_tick(follow, tmp_path):
    ended, reports = follow(GrowingRun(tmp_path / "run.mcap", GOLDEN.read_bytes(), 40))
    assert ended == f"the run has ended; its log is {tmp_path / 'run.mcap'}"
    assert len(reports) >= 3
    assert all(isinstance(report, RunReport) for report in reports)
    times = [report.now_ns for report in reports]
    assert times == sorted(set(times))
    assert Phase(reports[-1].control.phase).name in ("DONE", "FAILED")
    assert max(len(report.readings) for report in reports) <= 2 * MOST_TICKS


def test_a_run_that_was_cut_off_is_called_so(follow, tmp_path):
    data = GOLDEN.read_bytes()
    ended, reports = follow(GrowingRun(tmp_path / "run.mcap", data[: len(data) * 3 // 4], 4))
    assert ended == NOT_WHOLE
    assert reports, "what is there is shown"


def test_a_file_that_is_no_log_is_said_while_the_run_lives(follow, tmp_path):
    with pytest.raises(LogDamaged):
        follow(GrowingRun(tmp_path / "run.mcap", bytes(4096), 64))


def test_the_rig_is_that_of_the_log(tmp_path):
    rig = rig_of_run(RunningRun("emulated", (), {}, str(GOLDEN)))
    assert rig.name == "emulated"


def test_what_is_seen_of_a_run_has_the_ages_of_its_own_clock(follow, tmp_path):
    _, reports = follow(GrowingRun(tmp_path / "run.mcap", GOLDEN.read_bytes(), 40))
    seen = Seen(resolve_rig("emulated"))
    for report in reports:
        seen.take_run(report)
    told = as_json(view_of(seen, "the run", now_ns=2**60))
    assert told["run"]["phase"] in ("DONE", "FAILED")
    assert told["ft"]["age_ms"] < 20.0
    assert not told["base"]["pose_late"]
    assert {told[device]["state"] for device in ("ft", "arm", "base")} <= {LinkState.UP.name.lower(), "closed", "lost"}
    assert told["tare"] == "tared by the run"


def test_a_pause_of_the_operator_is_told_from_a_hold_for_a_fault(follow, tmp_path):
    _, reports = follow(GrowingRun(tmp_path / "run.mcap", GOLDEN.read_bytes(), 4))
    seen = Seen(resolve_rig("emulated"))
    seen.take_run(replace(reports[0], paused=True))
    assert as_json(view_of(seen, "the run", now_ns=2**60))["run"]["mode"] == "PAUSED"
