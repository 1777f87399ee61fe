"""`push sweep hardware`: the paper's experiment on whole runs of the program."""

import csv
import json

import numpy as np
import pytest

from tools import cli
from tools.sweep import hardware as study_hardware
from tools.sweep.hardware import hardware_items, rig_of, run_hardware_item
from tools.sweep.hardware_summary import summarise_hardware


def test_ten_pushes_by_the_law_and_five_of_their_starts_open_loop():
    items = hardware_items(None)
    assert [item.run for item in items] == list(range(30))
    for slider in ("box", "barrel"):
        closed = [i for i in items if i.slider == slider and i.controller == "force"]
        opened = [i for i in items if i.slider == slider and i.controller == "open-loop"]
        assert (len(closed), len(opened)) == (10, 5)
        assert {(i.k_f, i.k_y_rad_per_m) for i in closed} == {(0.1, 0.3)}
        assert {i.edge_offset_m for i in opened} < {i.edge_offset_m for i in closed}
        assert len({i.edge_offset_m for i in closed}) == 10
    rig = rig_of(items[0])
    assert rig.control.distance_m == 6
    assert rig.world.floor.patch_strength > 0
    assert rig_of(items[15]).world.slider.shape == "circle"


def test_an_open_loop_push_loses_the_box_and_repeats_to_the_bit():
    item = hardware_items(None)[10]
    part, again = run_hardware_item(item), run_hardware_item(item)
    (row,) = part.rows
    assert row["code"] == "lost"
    assert row["exit_code"] == 6
    assert 0.3 < row["distance_m"] < 2
    assert again.rows == part.rows
    assert np.array_equal(again.arrays["slider"], part.arrays["slider"])
    assert part.arrays["slider"].shape[1] == 3


def test_a_push_that_cannot_be_run_is_a_row(monkeypatch):
    def broken(item):
        raise ValueError("no rig")

    monkeypatch.setattr(study_hardware, "rig_of", broken)
    part = run_hardware_item(hardware_items(None)[0])
    assert part.rows[0]["code"] == "error"
    assert part.rows[0]["error"] == "ValueError: no rig"


def test_what_is_otherwise_than_in_the_paper_is_said_with_numbers():
    def row(run, controller, code, distance, greatest):
        return {"run": run, "slider": "box", "controller": controller, "code": code, "distance_m": distance,
                "max_abs_y_m": greatest, "lateral_error_m": 0.1, "edge_offset_m": 0.02}  # fmt: skip

    rows = [row(0, "force", "done", 6.0, 0.3), row(1, "force", "done", 6.0, 0.7), row(2, "force", "lost", 3.0, 0.2),
            row(3, "open-loop", "lost", 1.4, 0.2), row(4, "open-loop", "lost", 2.6, 0.2)]  # fmt: skip
    way = np.linspace(0.3, 6.3, 61)
    states = np.array([np.stack([way, np.where(way > 3.3, 0.2, 0.1), way], axis=1)] * 5)
    summary = summarise_hardware(rows, states)
    box = summary["sliders"]["box"]
    assert (box["closed_loop_done"], box["closed_loop_inside_corridor"]) == (2, 1)
    assert (box["open_loop_runs"], box["open_loop_lost_within_2_m"]) == (2, 1)
    assert box["closed_loop_weave_growth"] == pytest.approx(2.0)
    told = summary["otherwise_than_the_paper"]
    assert len(told) == 3
    assert "0.70 m" in told[0]
    assert "lost" in told[1]
    assert "2.60 m" in told[2]


@pytest.mark.parametrize("argv", [["--dt", "0.01"], ["--open-loop"]])
def test_flags_of_other_studies_are_refused(tmp_path, capsys, argv):
    assert cli.main(["sweep", "hardware", *argv, "--out", str(tmp_path / "out")]) == 2
    assert "hardware" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_gains_that_no_rig_may_have_are_refused_before_anything_runs(tmp_path, capsys):
    assert cli.main(["sweep", "hardware", "--gains=0.1,5", "--out", str(tmp_path / "out")]) == 2
    assert "k_y_rad_per_m" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.long
@pytest.mark.timeout(600)
def test_the_whole_experiment_does_what_the_paper_says(tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["sweep", "hardware", "--out", str(out), "--json"]) == 0
    stdout, err = capsys.readouterr()
    summary = json.loads(stdout.splitlines()[-1])
    for slider in ("box", "barrel"):
        found = summary["sliders"][slider]
        assert found["closed_loop_inside_corridor"] == 10
        # The paper lost all five within 2 m. With the noise of `[world]`, the box that starts 8 mm off its middle,
        # nearest to where it would balance, goes a little further, and the study says so.
        assert found["open_loop_lost_within_2_m"] == (4 if slider == "box" else 5)
        assert max(found["open_loop_lost_after_m"]) < 2.2
        assert slider in err
    [otherwise] = summary["otherwise_than_the_paper"]
    assert otherwise.startswith("box, open-loop run 12: lost after 2.1")
    # the paper's gains are beyond the limit of the box: its weave grows
    assert summary["sliders"]["box"]["closed_loop_weave_growth"] > 1
    with (out / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["code"] for row in rows].count("done") == 20
    with np.load(out / "states.npz") as file:
        assert file["states"].shape[0] == 30
    for name in ("trajectories.png", "trajectories.svg"):
        assert (out / name).stat().st_size > 5000
