"""Describe a study for `push sweep`: its items, the function that runs them, and how parts become results."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from tools.parallel.part import Part
from tools.sweep.grid import Study
from tools.sweep.items import COLUMNS, cut, run_lane_item
from tools.sweep.paper import sample_cases

if TYPE_CHECKING:
    from tools.parallel.store import Store

ROOT = Path(__file__).resolve().parents[2]
LANE_SOURCES = tuple(
    ROOT / f"{name}.py"
    for name in (
        "sim_backend/physics/batch", "sim_backend/physics/lanes", "sim_backend/physics/shapes",
        "sim_backend/physics/slider", "sim_backend/physics/slider_exact", "sim_backend/physics/support",
        "tools/sweep/grid", "tools/sweep/items",
    )
)  # fmt: skip


class Plan(NamedTuple):
    """A study ready to run.

    definition: everything its numbers depend on except the source files in `sources`. items: each with `.cases`.
    prepare: called once in this process before workers start. write: writes the results from all parts, returns the
    summary and its readable lines.
    """

    name: str
    definition: object
    sources: Sequence[Path]
    items: Sequence[Any]
    function: Callable[[Any], Part]
    prepare: Callable[[], None]
    write: Callable[[Store, list[Part]], tuple[dict[str, Any], list[str]]]


def lanes_plan(study: Study) -> Plan:
    """Return the plan of a study of lanes."""

    def write(store: Store, parts: list[Part]) -> tuple[dict[str, Any], list[str]]:
        return _write_lanes(study, store, parts)

    return Plan(study.name, msgspec.to_builtins(study), LANE_SOURCES, cut(study), run_lane_item, compile_kernel, write)


def compile_kernel() -> None:
    """Compile the lane kernel once in this process, so that workers find it in numba's cache."""
    from sim_backend.physics.batch import run_batch
    from sim_backend.physics.lanes import Lane, Timing

    run_batch([Lane(True, 0.5, 0.5, 0.3, 0.5, 0.0, 0.0, 0.0)], Timing(steps=1, record_every=1))


def _write_lanes(study: Study, store: Store, parts: list[Part]) -> tuple[dict[str, Any], list[str]]:
    """Write results.csv, states.npz, summary.json and the figures."""
    import numpy as np

    from tools.sweep import figures as sweep_figures
    from tools.sweep.summary import sentences, summarise

    rows = [row for part in parts for row in part.rows]
    states = np.concatenate([part.arrays["states"] for part in parts])
    integral = ("k_i",) if any("k_i" in row for row in rows) else ()
    store.write_csv("results.csv", (*COLUMNS, *integral), rows)
    store.write_arrays("states.npz", {"states": states})
    summary = summarise(study, rows, states)
    store.write_json("summary.json", summary)
    title = f"{study.name}: {len(study.cases)} pushes of {study.timing.steps * study.timing.dt_s:g} s"
    ends = np.array([(row.get("x", math.nan), row.get("y", math.nan)) for row in rows], dtype=np.float64)
    files = sweep_figures.save(sweep_figures.trajectories(study.cases, states, ends, title), store.out, "trajectories")
    if chosen := sample_cases(study.cases)[:8]:
        shown = [study.cases[i] for i in chosen]
        files += sweep_figures.save(sweep_figures.samples(shown, study.timing), store.out, "samples")
    return summary | {"files": ["results.csv", "states.npz", "summary.json", *files]}, sentences(summary)
