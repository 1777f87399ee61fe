"""The tables that `make paper` writes into the docs."""

import json

from tools.dev import paper
from tools.dev.paper import PAGE, SWEEP, TABLES, study_table, sweep_table, write_table
from tools.study.results import Runs
from tools.study.study_file import find_study, load_study, shipped_studies

HAND = json.dumps([{"at_s": 5.5, "for_s": 3600.0, "force_body_N": [0.0, 0.12, 0.0]}])


def row(law, turned, hand, end, verdict="done", exit_code="0"):
    return {"control.law": law, "world.truth.sensor_yaw_deg": turned, "world.hand": hand, "end_lateral_m": end,
            "verdict": verdict, "exit_code": exit_code}  # fmt: skip


def test_a_line_for_each_error_and_a_column_for_each_law():
    rows = [row("force", "0.0", "[]", "0.01"), row("force", "0.0", "[]", "-0.03"), row("line", "0.0", "[]", "0.02"),
            row("force", "1.0", HAND, "", "contact lost", "6")]  # fmt: skip
    assert study_table(Runs(tuple(rows[0]), rows), TABLES["calibration"]) == [
        "| sensor turned, degrees | tare off, N | force | line |",
        "|---|---|---|---|",
        "| 0.0 | 0 | 2.0 cm | 2.0 cm |",
        "| 1.0 | 0.12 | - |  |",
    ]


def test_what_was_not_done_is_said():
    rows = [row("force", "0", "[]", "0.1"), row("force", "0", "[]", "0.3", "off the line", "9"),
            row("force", "0", "[]", "", "contact lost", "6")]  # fmt: skip
    assert paper.ended_and_offset(rows) == "1/3, 1 contact lost, 1 off the line; 20.0 cm"


def test_the_papers_sweep_is_a_line_a_shape():
    ends = {"median": 0.0012, "p90": 0.002, "max": 0.013}
    found = {"lanes": 243, "converged": 243, "final_abs_y_m": ends, "max_abs_y_m": {"median": 1, "p90": 1, "max": 1.5}}
    assert sweep_table({"shapes": {"square": found}})[2] == "| square | 243 | 243 | 1.2 mm | 13 mm | 1.50 m |"


def test_only_what_is_between_the_marks_is_written(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table one -->\nold\n<!-- end -->\nbetween\n<!-- table two -->\n<!-- end -->\n")
    write_table(page, "one", ["| a |", "|---|"])
    assert page.read_text() == (
        "before\n<!-- table one -->\n| a |\n|---|\n<!-- end -->\nbetween\n<!-- table two -->\n<!-- end -->\n"
    )


def test_every_shipped_study_has_a_table_in_the_page_and_its_axes_are_there():
    assert set(TABLES) == set(shipped_studies())
    text = PAGE.read_text()
    for name in (*TABLES, SWEEP):
        assert f"<!-- table {name} -->" in text
    for name, matrix in TABLES.items():
        assert {*matrix.down, matrix.across} <= set(load_study(find_study(name)).keys)
