"""`push study` as a user runs it: bytes, interruptions, logs, laws of one's own, and running it again."""

import csv
import json

import pytest

from tests.how_many import mostly_long
from tools import cli
from tools.study import plan as study_plan
from tools.study.one_push import FIXED_AFTER, Job, run_push
from tools.study.pushes import Push

STUDY = """
[study]
name = "small"
seeds = 2
[settings]
control.distance_m = 0.05
ft.tare_s = 0.5
control.retreat_m = 0.0
[axes]
control.law = ["force", "open-loop"]
"""
LAW = '''
import msgspec
class Straight:
    """Straight ahead."""
    name = "straight"
    class Settings(msgspec.Struct, frozen=True):
        turn: float = 0.0
    class State(msgspec.Struct, frozen=True):
        steps: int = 0
    def __init__(self, control, settings):
        self.turn = settings.turn
    def initial(self):
        return self.State()
    def step(self, state, seen):
        return self.turn, self.State(state.steps + 1)
'''


def push(capsys, *argv):
    code = cli.main([str(word) for word in argv])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(STUDY)
    return path


def rows_of(folder):
    with (folder / "runs.csv").open(newline="") as found:
        return list(csv.DictReader(found))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """One finished study, for the tests that only read it."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "small.toml").write_text(STUDY)
    assert cli.main(["study", str(folder / "small.toml"), "--out", str(folder / "out"), "--workers", "1"]) == 0
    return folder / "out"


def test_a_folder_holds_table_summary_figures_and_who_made_them(done):
    rows = rows_of(done)
    assert list(rows[0]) == ["run", "seed", "control.law", *FIXED_AFTER]
    assert [row["verdict"] for row in rows] == ["done"] * 4
    assert all(abs(float(row["distance_m"]) - 0.05) < 0.002 for row in rows)  # noise of the pose: 0.5 mm
    summary = json.loads((done / "summary.json").read_text())
    assert summary["all"]["verdicts"]["done"]["runs"] == 4
    assert set(summary["by"]["control.law"]) == {"force", "open-loop"}
    made = json.loads((done / "made_by.json").read_text())
    assert {"commit", "dirty", "versions", "machine"} <= set(made)
    assert not any(word in (done / "runs.csv").read_text() for word in (made["machine"]["system"], made["at"]))
    assert (done / "study.toml").read_text() == STUDY
    for name in ("trajectories", "survival"):
        assert (done / "figures" / f"{name}.svg").stat().st_size > 3000


def test_show_filters_sorts_and_sums_up(done, capsys):
    code, out, _ = push(capsys, "study", "show", done, "--where", "control.law=force", "--sort", "|end_lateral_m|")
    assert code == 0
    assert len(out.splitlines()) == 3
    code, out, _ = push(capsys, "study", "show", done, "--by", "control.law", "--json")
    found = json.loads(out)
    assert [(row["control.law"], row["runs"], row["done"]) for row in found["rows"]] == [
        ("force", 2, 2), ("open-loop", 2, 2),
    ]  # fmt: skip
    code, _, err = push(capsys, "study", "show", done, "--sort", "nothing")
    assert (code, "nothing" in err) == (2, True)


def test_running_it_again_gives_the_same_bytes_or_says_what_differs(done, capsys, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("study.toml", "rig.toml", "made_by.json", "runs.csv"):
        (copy / name).write_bytes((done / name).read_bytes())
    code, _, err = push(capsys, "study", "rerun", copy, "--workers", 1)
    assert (code, "the same to the last byte" in err) == (0, True)
    text = (copy / "runs.csv").read_text()
    peak = rows_of(copy)[2]["peak_force_N"]
    (copy / "runs.csv").write_text(text.replace(peak, "16.5"))
    code, _, err = push(capsys, "study", "rerun", copy, "--workers", 1)
    assert code == 7
    assert "run 2: peak_force_N" in err
    assert "was 16.5" in err


def test_a_folder_that_is_no_study_is_refused(tmp_path, capsys):
    for words in (("show",), ("rerun",)):
        code, _, err = push(capsys, "study", *words, tmp_path)
        assert code == 2
        assert len(err.strip().splitlines()) == 1
    (tmp_path / "mine.txt").write_text("mine")
    code, _, err = push(capsys, "study", "masses", "--out", tmp_path)
    assert (code, "not a study folder" in err) == (2, True)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_after_an_interruption_only_the_rest_is_run_and_the_bytes_are_the_same(
    done, file, tmp_path, capsys, monkeypatch
):
    real, ran = study_plan.run_push, []

    def interrupted(job):
        if len(ran) == 3:
            raise KeyboardInterrupt
        ran.append(job.push.run)
        return real(job)

    monkeypatch.setattr(study_plan, "run_push", interrupted)
    out = tmp_path / "cut"
    code, _, err = push(capsys, "study", file, "--out", out, "--workers", 1)
    assert (code, "3 of 4" in err, "--resume" in err) == (130, True, True)
    (out / "parts" / "000001.npz").write_bytes(b"PK\x03\x04 spoilt")
    monkeypatch.setattr(study_plan, "run_push", lambda job: ran.append(job.push.run) or real(job))
    code, _, err = push(capsys, "study", file, "--out", out, "--workers", 1, "--resume")
    assert code == 0
    assert ran == [0, 1, 2, 1, 3]
    assert (out / "runs.csv").read_bytes() == (done / "runs.csv").read_bytes()


@pytest.mark.parametrize("kept", mostly_long(("full", "ticks"), "ticks"))
def test_a_log_of_a_study_replays_and_changes_nothing(done, file, tmp_path, capsys, kept):
    file.write_text(STUDY.replace("seeds = 2", "seeds = 1").replace(', "open-loop"', ""))
    out = tmp_path / "out"
    assert push(capsys, "study", file, "--out", out, "--workers", 1, "--log", kept)[0] == 0
    assert rows_of(out) == rows_of(done)[:1]
    code, told, _ = push(capsys, "replay", out / "logs" / "000000.mcap", "--json")
    found = json.loads(told.splitlines()[-1])
    assert code == 0
    if kept == "full":
        assert found["derived"]["messages"] > 0
    else:
        assert found["derived"] is None
        assert any("left out of this log" in note for note in found["notes"])


def test_a_law_beside_the_file_is_studied_under_its_own_name(tmp_path, capsys):
    (tmp_path / "straight.py").write_text(LAW)
    path = tmp_path / "mine.toml"
    path.write_text(STUDY.replace("seeds = 2", "seeds = 1").replace('"open-loop"', '"straight:Straight"'))
    assert push(capsys, "study", path, "--out", tmp_path / "out", "--workers", 1)[0] == 0
    assert [row["law"] for row in rows_of(tmp_path / "out")] == ["force feedback", "straight"]
    made = json.loads((tmp_path / "out" / "made_by.json").read_text())
    assert list(made["laws"]) == ["straight:Straight"]


def test_an_impossible_push_is_a_row_with_its_reason():
    part = run_push(Job(Push(3, 0, {"a": "b"}, _rig("world.solver=osqp", "control.law=mine:Law"), "/nowhere")))
    assert part.rows[0]["verdict"] == "refused"
    assert part.rows[0]["exit_code"] == 2
    assert "mine:Law" in str(part.rows[0]["against"])


def test_where_the_object_is_comes_from_the_world_and_not_from_motion_capture():
    rig = ("control.distance_m=0.05", "world.truth.slider_offset_m=[0.3,0.2]", "world.start.heading_deg=0.0",
           "world.start.edge_offset_m=0.0", "world.start.lateral_offset_m=0.0", "path.direction_deg=30")  # fmt: skip
    [row] = run_push(Job(Push(0, 0, {}, _rig(*rig), "/nowhere"))).rows
    assert abs(float(row["object_lateral_m"])) < 0.03
    assert abs(float(row["object_heading_deg"])) < 3


def _rig(*settings):
    from robot_io.rig.config import load_rig, rig_to_toml

    return rig_to_toml(load_rig("sim", settings))


@pytest.mark.long
@pytest.mark.timeout(600)
def test_any_number_of_workers_gives_the_same_bytes(done, file, tmp_path, capsys):
    for workers in (2, 3):
        out = tmp_path / str(workers)
        assert push(capsys, "study", file, "--out", out, "--workers", workers)[0] == 0
        for name in ("runs.csv", "summary.json", "figures/trajectories.svg"):
            assert (out / name).read_bytes() == (done / name).read_bytes()
