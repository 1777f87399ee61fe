"""The table of runs: a row for each with its verdict, where pusher and object went, forces, faults and note."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from control.notes.run_notes import outcome
from tools.report.bounded_series import Floats
from tools.report.compare.given_runs import ComparedRun
from tools.report.drawing.plan_view import PUSHED, RunInPlan


class Result(NamedTuple):
    """What came of a run; m, N and degrees, NaN where unknown. Errors are lateral, left of the path positive."""

    run: int
    settings: str
    verdict: str
    distance_m: float
    pusher_end_m: float
    pusher_worst_m: float
    object_end_m: float
    object_worst_m: float
    object_turned_deg: float
    force_median_N: float
    force_greatest_N: float
    faults: str
    note: str
    log: str


HEADS = (
    "", "run", "verdict", "distance (m)", "pusher at the end (m)", "pusher, worst (m)", "object at the end (m)",
    "object, worst (m)", "object turned (deg)", "force, median (N)", "force, greatest (N)", "faults", "note",
)  # fmt: skip


def result(one: ComparedRun) -> Result:
    """Return the row of a run."""
    run, place = one.run, RunInPlan(one.run)
    pushed = np.isin(place.phase, PUSHED)
    end: dict[str, Any] = dict(outcome(run.last.input, run.last.after, run.last.output)) if run.last else {}
    times = run.ticks["t_s"][pushed]
    seen_s, _, left, yaw = place.slider()
    during = (seen_s >= times[0]) & (seen_s <= times[-1]) if len(times) else np.zeros(len(seen_s), dtype=bool)
    during &= np.isfinite(left) & np.isfinite(yaw)
    turned = np.unwrap(yaw[during])
    force = np.hypot(run.ticks["force_x"], run.ticks["force_y"])[pushed]
    force = force[np.isfinite(force)]
    raw = run.ticks["force_raw"][np.isfinite(run.ticks["force_raw"])]
    return Result(
        run=one.number,
        settings=one.label,
        verdict=one.verdict.word,
        distance_m=float(end.get("distance_m", math.nan)),
        pusher_end_m=float(end.get("lateral_error_m", math.nan)) if len(times) else math.nan,
        pusher_worst_m=_worst(place.y[pushed]),
        object_end_m=_last(left[during]),
        object_worst_m=_worst(left[during]),
        object_turned_deg=math.degrees(turned[-1] - turned[0]) if len(turned) else math.nan,
        force_median_N=float(np.median(force)) if len(force) else math.nan,
        force_greatest_N=float(raw.max()) if len(raw) else math.nan,
        faults=", ".join(dict.fromkeys(span.name for span in run.faults)),
        note=one.note,
        log=str(run.log),
    )


def as_csv(results: Sequence[Result]) -> str:
    """Return the table as CSV, with units in its head; an unknown number is an empty cell."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(Result._fields)
    for row in results:
        writer.writerow("" if value != value else _rounded(value) for value in row)
    return target.getvalue()


def as_cells(row: Result) -> tuple[str, ...]:
    """Return a row in words for the page's table, under `HEADS`."""
    return (
        str(row.run),
        row.settings,
        row.verdict,
        _number(row.distance_m, ".2f"),
        *(_number(v, "+.3f") for v in (row.pusher_end_m, row.pusher_worst_m, row.object_end_m, row.object_worst_m)),
        _number(row.object_turned_deg, "+.0f"),
        _number(row.force_median_N, ".1f"),
        _number(row.force_greatest_N, ".1f"),
        row.faults or "none",
        row.note,
    )


def _rounded(value: object) -> object:
    return round(value, 4) if isinstance(value, float) else value


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if math.isfinite(value) else "-"


def _last(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite[-1]) if len(finite) else math.nan


def _worst(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite[np.argmax(np.abs(finite))]) if len(finite) else math.nan
