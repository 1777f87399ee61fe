"""What many pushes say: medians with bootstrap intervals, rates with Wilson's, and the worst cases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import Any

from tools.study.results import Runs, groups, number

RESAMPLES = 1000
SEED = 20260101
"""Of the bootstrap: the same rows give the same interval."""
MOST_DRAWN_AT_ONCE = 1_000_000
CONFIDENCE_Z = 1.959963984540054
"""Two-sided 95 % of a normal distribution."""
SIZES = ("end_lateral_m", "worst_lateral_m", "object_lateral_m", "object_heading_deg")
"""Columns of which the size counts, not the sign."""
PLAIN = ("distance_m", "peak_force_N", "lost_s")
WORST = 5


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate (Wilson, JASA 22, 1927); (0, 1) of nothing."""
    if not of:
        return 0.0, 1.0
    z2 = CONFIDENCE_Z * CONFIDENCE_Z
    share = hits / of
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = CONFIDENCE_Z * math.sqrt(share * (1 - share) / of + z2 / (4 * of * of)) / (1 + z2 / of)
    return (0.0 if hits == 0 else max(0.0, middle - half)), (1.0 if hits == of else min(1.0, middle + half))


def bootstrap_median(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % percentile interval of the median over RESAMPLES draws with replacement, by a fixed seed."""
    import numpy as np

    rng = np.random.Generator(np.random.PCG64(SEED))
    sample = np.sort(np.asarray(values, dtype=np.float64))
    size, medians = len(sample), []
    for first in range(0, RESAMPLES, at_once := max(1, MOST_DRAWN_AT_ONCE // size)):
        drawn = rng.integers(0, size, (min(at_once, RESAMPLES - first), size))
        medians += np.median(sample[drawn], axis=1).tolist()
    medians.sort()
    return float(medians[round(0.025 * (RESAMPLES - 1))]), float(medians[round(0.975 * (RESAMPLES - 1))])


def figures(rows: Sequence[dict[str, str]]) -> dict[str, Any]:
    """Return the figures of some runs: how they ended, and the distribution of each measured column."""
    verdicts: dict[str, int] = {}
    for row in rows:
        verdicts[row["verdict"]] = verdicts.get(row["verdict"], 0) + 1
    rates = {}
    for verdict, hits in sorted(verdicts.items()):
        low, high = wilson(hits, len(rows))
        rates[verdict] = {"runs": hits, "rate": hits / len(rows), "low": low, "high": high}
    return {"runs": len(rows), "verdicts": rates, **{key: spread(rows, key) for key in (*SIZES, *PLAIN)}}


def spread(rows: Sequence[dict[str, str]], key: str) -> dict[str, float] | None:
    """Return median with its interval, 95th percentile and maximum of a column; of SIZES without sign. None: empty."""
    values = sorted(abs(x) if key in SIZES else x for row in rows if not math.isnan(x := number(row[key])))
    if not values:
        return None
    low, high = bootstrap_median(values)
    p95 = values[math.ceil(0.95 * len(values)) - 1]
    return {"median": median(values), "low": low, "high": high, "p95": p95, "max": values[-1]}


def summarise(name: str, runs: Runs, axes: Sequence[str]) -> dict[str, Any]:
    """Return the summary of a study: all runs, each value of each listed axis, each combination, and the worst.

    axes: those whose values are listed, not drawn.
    """
    by = {axis: {value: figures(rows) for (value,), rows in groups(runs, [axis]).items()} for axis in axes}
    combined = [
        {"axes": dict(zip(axes, values, strict=True)), **figures(rows)}
        for values, rows in groups(runs, axes).items()
        if len(axes) > 1 and len(rows) > 1
    ]
    return {
        "schema": 1,
        "study": name,
        "intervals": f"95 %: of medians by {RESAMPLES} bootstrap draws with a fixed seed, of rates by Wilson",
        "all": figures(runs.rows),
        "by": by,
        "combinations": combined,
        "worst": {key: worst(runs, key) for key in ("end_lateral_m", "worst_lateral_m", "object_lateral_m")},
        "not_done": [_named(row) for row in runs.rows if row["verdict"] != "done"][:100],
    }


def worst(runs: Runs, key: str) -> list[dict[str, Any]]:
    """Return the runs with the largest size of a column, the largest first."""
    known = [row for row in runs.rows if not math.isnan(number(row[key]))]
    largest = sorted(known, key=lambda row: -abs(number(row[key])))[:WORST]
    return [_named(row) | {key: number(row[key])} for row in largest]


def sentences(summary: dict[str, Any]) -> list[str]:
    """Return the summary as lines for people."""
    lines = [_sentence("all", summary["all"])]
    for axis, values in summary["by"].items():
        if len(values) > 1:
            lines += [_sentence(f"{axis} = {value}", found) for value, found in values.items()]
    return lines


def _sentence(name: str, found: dict[str, Any]) -> str:
    done = found["verdicts"].get("done", {"runs": 0})["runs"]
    end = found["end_lateral_m"]
    offset = "" if end is None else f", end offset {_cm(end['median'])} (median), {_cm(end['p95'])} (95 %)"
    return f"{name}: {done} of {found['runs']} done{offset}"


def _cm(metres: float) -> str:
    return f"{round(metres * 100, 1) + 0.0:.1f} cm"  # no "-0.0"


def _named(row: dict[str, str]) -> dict[str, Any]:
    whole = {key: int(row[key]) for key in ("run", "seed")}
    return {**whole, "verdict": row["verdict"], "first_fault": row["first_fault"]}
