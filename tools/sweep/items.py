"""Divide a study into work items: a few lanes of one shape each, and their results.

A worker gets one item at a time and returns rows (one per lane, for `results.csv`) and arrays. A lane that fails
yields a row with the error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from robot_io.errors import EnvironmentFault, PushError
from sim_backend.physics.lanes import LaneEnd, LaneResult, Timing
from tools.parallel.part import Part, Row
from tools.sweep.grid import Case, Study, lane_of

STEPS_PER_ITEM = 1_700_000
"""About 0.1 s of work: enough to hide the cost of the transfer, little enough to lose on an interruption."""
MOST_LANES_PER_ITEM = 1000

PARAMETER_COLUMNS = (
    "lane", "shape", "length_m", "width_m", "radius_m", "pressure", "tau_max", "mu", "y0", "phi0", "s0",
    "speed", "k_f", "k_y", "f_max", "controller",
)  # fmt: skip
RESULT_COLUMNS = (
    "code", "steps", "x", "y", "phi", "s", "fx", "fy", "max_abs_y", "max_abs_y_c", "max_abs_theta_p",
    "min_vn_over_speed", "steps_sticking", "steps_sliding_left", "steps_sliding_right", "error",
)  # fmt: skip
COLUMNS = PARAMETER_COLUMNS + RESULT_COLUMNS
"""Units: m, rad, N, N*m, m/s; `code` is ok, edge, pull or error; a field that has no value is empty."""


class LaneItem(msgspec.Struct, frozen=True):
    """Some consecutive cases of one shape; `first` is the number of the first in the study."""

    first: int
    cases: tuple[Case, ...]
    timing: Timing


def cut(study: Study) -> list[LaneItem]:
    """Cut a study into items, independently of the machine, so that any machine can finish it."""
    size = max(1, min(MOST_LANES_PER_ITEM, STEPS_PER_ITEM // study.timing.steps))
    items: list[LaneItem] = []
    start = 0
    for i in range(1, len(study.cases) + 1):
        if i == len(study.cases) or i - start == size or study.cases[i].shape != study.cases[start].shape:
            items.append(LaneItem(start, study.cases[start:i], study.timing))
            start = i
    return items


def run_lane_item(item: LaneItem) -> Part:
    """Run an item's lanes; arrays: `states`, shape (cases, records, 6), NaN after a lane's end.

    Raises EnvironmentFault if numba is missing.
    """
    import numpy as np

    try:
        return _run(item)
    except EnvironmentFault:
        raise  # this machine cannot compute anything: another one may still run the case
    except PushError as error:
        message = str(error)
    except Exception as error:  # one bad case must not abort the study; its row names the defect
        message = f"{type(error).__name__}: {error}"
    if len(item.cases) > 1:  # find the failing case; the others are fine
        parts = [run_lane_item(LaneItem(item.first + i, (case,), item.timing)) for i, case in enumerate(item.cases)]
        states = np.concatenate([part.arrays["states"] for part in parts])
        return Part([row for part in parts for row in part.rows], {"states": states})
    return Part([_failed(item.first, item.cases[0], message)], {"states": np.full((1, item.timing.records, 6), np.nan)})


def _run(item: LaneItem) -> Part:
    import numpy as np

    from sim_backend.physics.batch import run_batch

    results, states = run_batch([lane_of(case) for case in item.cases], item.timing)
    rows: list[Row] = []
    for i, (case, result) in enumerate(zip(item.cases, results, strict=True)):
        if all(map(math.isfinite, (*result.final, result.max_abs_y_c_m, result.max_abs_theta_p_rad))):
            rows.append(_parameters(item.first + i, case) | _result(result))
        else:
            rows.append(_failed(item.first + i, case, "its state overflowed"))
            states[i] = np.nan
    return Part(rows, {"states": np.asarray(states)})


def _failed(number: int, case: Case, sentence: str) -> Row:
    return _parameters(number, case) | {"code": LaneEnd.ERROR.name.lower(), "steps": 0, "error": sentence}


def _parameters(number: int, case: Case) -> Row:
    is_round = case.shape == "circle"
    row: Row = {"lane": number, "shape": case.shape}
    if is_round:
        row["radius_m"] = case.radius_m
    else:
        row["length_m"] = case.length_m
        row["width_m"] = case.length_m if case.shape == "square" else case.width_m
    if not case.tau_max_Nm:
        row["pressure"] = case.pressure
    return row | {
        "tau_max": lane_of(case).d_m * case.f_max_N,
        "mu": case.contact_friction,
        "y0": case.y0_m,
        "phi0": case.phi0_rad,
        "s0": case.s0_m,
        "speed": case.speed_m_per_s,
        "k_f": case.k_f,
        "k_y": case.k_y_rad_per_m,
        "f_max": case.f_max_N,
        "controller": case.law,
        **({"k_i": case.k_i_rad_per_m2} if case.law == "force-integral" else {}),
    }


def _result(result: LaneResult) -> Row:
    names: Sequence[str] = RESULT_COLUMNS
    values = (
        result.end.name.lower(), result.steps, *result.final, result.max_abs_y_m, result.max_abs_y_c_m,
        result.max_abs_theta_p_rad, result.min_normal_speed_ratio, result.steps_sticking, result.steps_left,
        result.steps_right, "",
    )  # fmt: skip
    return dict(zip(names, values, strict=True))
