"""Intervals, rates, orders and conditions of a study's table: against closed forms and numbers by hand."""

import math
import random

import pytest

from robot_io.errors import UsageError
from tools.study.figures import survivors
from tools.study.results import Runs, chosen, groups, in_order
from tools.study.summary import bootstrap_median, figures, summarise, wilson

COLUMNS = (
    "run", "seed", "control.k_f", "verdict", "exit_code", "distance_m", "end_lateral_m", "worst_lateral_m",
    "object_lateral_m", "object_heading_deg", "peak_force_N", "lost_s", "first_fault", "against",
)  # fmt: skip


def run(number, **cells):
    row = dict.fromkeys(COLUMNS, "") | {"run": str(number), "seed": "0", "verdict": "done", "exit_code": "0"}
    return row | {key.replace("__", "."): str(value) for key, value in cells.items()}


def test_wilson_is_the_root_of_its_equation():
    # Its bounds p solve |hits/n - p| = z sqrt(p (1 - p) / n)
    for hits, of in ((3, 10), (1, 7), (190, 200)):
        for bound in wilson(hits, of):
            assert abs(hits / of - bound) == pytest.approx(1.959964 * math.sqrt(bound * (1 - bound) / of), rel=1e-6)
    # none of n: from 0 to z^2 / (n + z^2)
    assert wilson(0, 10) == (0.0, pytest.approx(1.959964**2 / (10 + 1.959964**2)))
    assert wilson(10, 10)[1] == 1.0


def test_the_interval_of_a_median_is_the_same_every_time_and_about_as_wide_as_it_should():
    rng = random.Random(1)
    values = [rng.gauss(5.0, 1.0) for _ in range(400)]
    low, high = bootstrap_median(values)
    assert (low, high) == bootstrap_median(values[::-1])
    # A normal sample's median has the standard error 1.2533 sigma / sqrt(n): 2 x 1.96 x 0.0627 = 0.246
    assert low < 5.0 < high
    assert high - low == pytest.approx(0.246, rel=0.4)
    assert bootstrap_median([2.0]) == (2.0, 2.0)


def test_offsets_count_by_their_size_and_missing_cells_do_not():
    rows = [run(0, end_lateral_m=-0.3), run(1, end_lateral_m=0.1), run(2, end_lateral_m=-0.2), run(3, verdict="error")]
    found = figures(rows)
    assert (found["end_lateral_m"]["median"], found["end_lateral_m"]["max"]) == (0.2, 0.3)
    assert found["peak_force_N"] is None
    assert found["verdicts"]["done"]["rate"] == 0.75


def test_the_summary_has_each_value_and_the_worst_runs():
    rows = [run(n, control__k_f=k, end_lateral_m=0.01 * n * (-1) ** n) for n, k in enumerate((0.1, 0.1, 0.3, 0.3))]
    summary = summarise("s", Runs(COLUMNS, rows), ["control.k_f"])
    assert summary["by"]["control.k_f"]["0.3"]["end_lateral_m"]["median"] == 0.025
    assert [one["run"] for one in summary["worst"]["end_lateral_m"]] == [3, 2, 1, 0]
    assert summary["worst"]["end_lateral_m"][0]["end_lateral_m"] == -0.03


def test_conditions_compare_numbers_sizes_and_words():
    rows = [
        run(n, end_lateral_m=v, verdict=w) for n, (v, w) in enumerate(((-0.3, "done"), (0.1, "lost"), ("", "done")))
    ]
    runs = Runs(COLUMNS, rows)

    def left(*conditions):
        return [int(row["run"]) for row in chosen(runs, conditions).rows]

    assert left("end_lateral_m<0") == [0]
    assert left("|end_lateral_m|>0.05") == [0, 1]
    assert left("verdict=done") == [0, 2]
    assert left("verdict!=done") == [1]
    assert left("verdict=done", "|end_lateral_m|>=0.3") == [0]
    with pytest.raises(UsageError, match="end_lateral_m"):
        chosen(runs, ["end_latreal_m<0"])
    with pytest.raises(UsageError, match="condition"):
        chosen(runs, ["verdict"])


def test_sorted_by_value_or_by_size_with_empty_cells_last():
    runs = Runs(COLUMNS, [run(n, end_lateral_m=v) for n, v in enumerate((0.1, "", -0.3, 0.2))])
    assert [row["run"] for row in in_order(runs, "end_lateral_m").rows] == ["2", "0", "3", "1"]
    assert [row["run"] for row in in_order(runs, "|end_lateral_m|", falling=True).rows] == ["2", "3", "0", "1"]


def test_the_end_of_a_columns_name_will_do():
    runs = Runs(COLUMNS, [run(0, control__k_f=0.1), run(1, control__k_f=0.3)])
    assert list(groups(runs, ["k_f"])) == [("0.1",), ("0.3",)]


def test_survival_falls_where_a_push_was_lost_and_not_where_it_arrived():
    rows = [run(0, distance_m=6.0), run(1, distance_m=2.0, exit_code=6), run(2, distance_m=4.0, exit_code=5),
            run(3, distance_m=6.0, exit_code=9)]  # fmt: skip
    assert survivors(rows) == ([0.0, 2.0, 4.0, 6.0], [1.0, 0.75, 0.5, 0.5])
