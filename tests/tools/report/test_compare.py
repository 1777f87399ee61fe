"""Several runs on one page: one picture, a table with what came of each, and words where they do not fit together."""

import csv
import json
import shutil
import xml.etree.ElementTree as ET

import pytest
from msgspec.structs import replace

from tests.tools.commands.test_report import EVIL, Page, hardware, rig_of, write_log
from tools.cli import main

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def compared(runs, tmp_path_factory):
    out = tmp_path_factory.mktemp("compared") / "out"
    assert (
        main(["report", str(runs / "one"), str(runs / "two" / "run.mcap"), str(runs / "open"), "--out", str(out)]) == 0
    )
    return out


def refused(capsys, *argv):
    """Return the error of a `push report` that is refused."""
    capsys.readouterr()
    code = main(["report", *map(str, argv), "--json"])
    found = capsys.readouterr()
    error = json.loads(found.out)["error"]
    assert code == error["code"]
    assert "Traceback" not in found.err
    return error


def told(runs, name):
    return json.loads((runs / name / "summary.json").read_text())


def test_page_picture_and_table_are_written(compared):
    assert {path.name for path in compared.iterdir()} == {"compare.html", "compare.svg", "compare.csv"}
    text = (compared / "compare.html").read_text()
    seen = Page(text)
    assert seen.words["h1"] == "3 runs compared"
    assert not {tag for tag, _ in seen.tags} & {"script", "link", "iframe", "img", "a"}
    assert "default-src 'none'" in text
    assert "https://" not in text
    assert "http://" not in text


def test_the_legend_says_what_differs(compared):
    root = ET.fromstring((compared / "compare.svg").read_text())
    texts = [element.text or "" for element in root.iter(f"{SVG}text")]
    assert [text for text in texts if text[:2] in ("1:", "2:", "3:")] == [
        "1: force feedback, seed 1", "2: force feedback, seed 2", "3: open loop, seed 1",
    ]  # fmt: skip


def test_the_table_says_what_the_runs_said(compared, runs):
    rows = list(csv.DictReader((compared / "compare.csv").read_text().splitlines()))
    assert [row["run"] for row in rows] == ["1", "2", "3"]
    for row, name in zip(rows, ("one", "two", "open"), strict=True):
        summary = told(runs, name)
        assert row["verdict"] == summary["verdict"]
        assert float(row["distance_m"]) == pytest.approx(summary["distance_m"], abs=1e-4)
        assert float(row["pusher_end_m"]) == pytest.approx(summary["lateral_error_m"], abs=1e-4)
        assert float(row["object_end_m"]) == pytest.approx(summary["object_lateral_error_m"], abs=0.005)
        assert abs(float(row["pusher_worst_m"])) >= abs(float(row["pusher_end_m"])) - 0.01
        assert row["faults"] == ""
        assert row["log"].endswith("run.mcap")


def test_the_picture_says_in_words_what_it_shows(compared, runs):
    alt = Page((compared / "compare.html").read_text()).pictures["compare"]
    assert f"run 1 (force feedback, seed 1): done after {told(runs, 'one')['distance_m']:.2f} m" in alt


def test_a_folder_of_trials_stands_for_its_runs(runs, tmp_path):
    for number, name in enumerate(("one", "two"), 1):
        shutil.copytree(runs / name, tmp_path / "trials" / f"trial-{number:02}")
    (tmp_path / "trials" / "trial-03").mkdir()  # one that did not start
    assert main(["report", str(tmp_path / "trials"), "--out", str(tmp_path / "out")]) == 0
    assert "2 runs compared" in (tmp_path / "out" / "compare.html").read_text()


def test_runs_that_differ_in_nothing_are_told_by_their_folders(runs, tmp_path, capsys):
    from tools.report.compare.labels import labels
    from tools.report.run_data import read_run

    one = read_run(runs / "one" / "run.mcap")
    again = read_run(runs / "one" / "run.mcap")
    again.log = tmp_path / "again" / "run.mcap"
    assert labels([one, again]) == ["one", "again"]


def test_the_same_run_twice_is_refused(runs, tmp_path, capsys):
    shutil.copytree(runs / "one", tmp_path / "copy")
    error = refused(capsys, runs / "one", tmp_path / "copy", "--out", tmp_path / "out")
    assert error["code"] == 2
    assert "the same run" in error["what"]
    assert str(tmp_path / "copy") in error["where"]
    assert not (tmp_path / "out").exists()


def test_a_damaged_log_is_named(runs, tmp_path, capsys):
    whole = (runs / "two" / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    error = refused(capsys, runs / "one", tmp_path / "cut.mcap", "--out", tmp_path / "out")
    assert error["code"] == 8
    assert "cut.mcap" in error["where"]
    assert not (tmp_path / "out").exists()


def test_runs_of_different_paths_are_said_to_be(runs, tmp_path, capsys):
    assert main(["report", str(runs / "one"), str(runs / "turned"), "--out", str(tmp_path / "out")]) == 0
    words = "These runs were pushed along different paths; each is drawn in the frame of its own path."
    assert words in capsys.readouterr().err
    assert words in (tmp_path / "out" / "compare.html").read_text()


def test_logs_without_a_push_and_with_hostile_names_are_shown_too(runs, tmp_path):
    rig = rig_of(runs / "one")
    logs = [
        write_log(tmp_path / "a.mcap", hardware(rig, name=EVIL), [], note=EVIL),
        write_log(tmp_path / "b.mcap", replace(rig, name="</svg>"), [], level="sim"),
    ]
    assert main(["report", *map(str, logs), str(runs / "one"), "--out", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "compare.html").read_text()
    assert "<script" not in text
    assert "&lt;/svg&gt;" in text
    assert "did not start" in text
    ET.fromstring((tmp_path / "out" / "compare.svg").read_text())


def test_nothing_is_overwritten(compared, runs, capsys):
    before = (compared / "compare.html").read_bytes()
    error = refused(capsys, runs / "one", runs / "two", "--out", compared)
    assert error["code"] == 2
    assert error["where"].endswith("compare.html")
    assert (compared / "compare.html").read_bytes() == before


def test_the_old_option_is_refused_with_the_new_way(runs, tmp_path, capsys):
    error = refused(capsys, runs / "one", runs / "two", "--compare", tmp_path / "x.png")
    assert error["code"] == 2
    assert "--out" in error["do"]


def test_without_out_a_folder_of_its_own_is_made(runs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(runs / "one"), str(runs / "two"), "--png", "--json"]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    (folder,) = tmp_path.iterdir()
    assert folder.name.startswith("compare-")
    assert [name.rpartition("/")[2] for name in files] == [
        "compare.html", "compare.svg", "compare.csv", "compare.png",
    ]  # fmt: skip
    assert (folder / "compare.png").read_bytes().startswith(b"\x89PNG")
