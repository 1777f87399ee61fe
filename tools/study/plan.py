"""Run a study into its folder: the pushes that are left, then table, summary, figures and who made them."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import os
import platform
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_io.errors import UsageError
from robot_io.rig.config import load_rig, rig_from_toml, rig_to_toml
from tools.parallel.work import Work, run_parts
from tools.run.facts.run_facts import code_and_machine
from tools.study.one_push import FIXED_AFTER, FIXED_BEFORE, Job, run_push
from tools.study.pushes import Push, base_rig, law_folders, pushes_of
from tools.study.results import FIGURES, MADE_BY, RIG, RUNS, STUDY, SUMMARY, read_runs
from tools.study.study_file import Listed, StudyFile
from tools.study.summary import sentences, summarise

if TYPE_CHECKING:
    from tools.parallel.store import Store

ROOT = Path(__file__).resolve().parents[2]
LOGS = "logs"
CHUNK_ROWS = 10_000
LISTED_VALUES = 100
"""An axis with more values has no table of its own in the summary."""


def run_study(study: StudyFile, out: Path, args: argparse.Namespace) -> dict[str, Any]:
    """Run what is left of a study into `out` and write its results; return the summary with `files` and `lines`.

    Raises ConfigError for a push that is none, UsageError for a folder of something else, OperatorStop.
    """
    from tools.parallel.store import Store, fingerprint

    began = time.monotonic()
    pushes = pushes_of(study)
    definition = [[push.run, push.seed, push.axes, push.rig] for push in pushes]
    store = Store(out, study.name, fingerprint([study.name, definition], sources()), resume=args.resume)
    store.write_bytes(STUDY, study.text.encode())
    store.write_bytes(RIG, rig_to_toml(load_rig(base_rig(study))).encode())
    run_parts(store, Work([_job(push, out, args.log) for push in pushes], run_push, _nothing), args, where=out)
    store.write_json(
        MADE_BY, made_by(args, law_folders(study), pushes) | {"took_s": round(time.monotonic() - began, 3)}
    )
    return write_results(store, study, len(pushes))


def _job(push: Push, out: Path, log: str) -> Job:
    where = "" if log == "none" else str(out.resolve() / LOGS / f"{push.run:06d}.mcap")
    return Job(push, where, log == "ticks")


def _nothing() -> None:
    """Do nothing: the pushes need no preparation."""


def write_results(store: Store, study: StudyFile, pushes: int) -> dict[str, Any]:
    """Write table, summary and figures from the parts, reading one part at a time."""
    from tools.study.figures import MOST_COURSES, MOST_PANELS, draw_all

    columns = (*FIXED_BEFORE, *study.keys, *FIXED_AFTER)
    every = -(-pushes // (MOST_COURSES * MOST_PANELS))
    rows, kept = [], {}
    for index, part in enumerate(store.each(pushes)):
        rows += part.rows
        if index % every == 0:
            kept[index] = part.arrays["course"]
    store.write_csv(RUNS, columns, rows)
    del rows
    runs = read_runs(store.out)
    axes = [axis.key for axis in study.axes if isinstance(axis, Listed) and len(axis.values) <= LISTED_VALUES]
    summary = summarise(study.name, runs, axes)
    store.write_json(SUMMARY, summary)
    files = [RUNS, SUMMARY, *draw_all(runs, kept, axes, store.out / FIGURES, study.name)]
    if importlib.util.find_spec("pyarrow") is not None:
        files.append(_write_parquet(store.out))
    return summary | {"files": files, "lines": sentences(summary)}


def _write_parquet(out: Path) -> str:
    """Write the same table as Parquet."""
    arrow_csv: Any = importlib.import_module("pyarrow.csv")
    parquet: Any = importlib.import_module("pyarrow.parquet")
    parquet.write_table(arrow_csv.read_csv(out / RUNS), out / "runs.parquet")
    return "runs.parquet"


def made_by(args: argparse.Namespace, folders: Sequence[str], pushes: Sequence[Push]) -> dict[str, Any]:
    """Return who made a study: commit, versions, machine, and what may not change its rows."""
    from importlib.metadata import PackageNotFoundError, version

    versions = {}
    for name in ("numpy", "joblib", "distributed", "osqp", "numba", "mujoco", "matplotlib", "pyarrow"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    facts = code_and_machine()
    return {
        "schema": 1,
        "commit": facts.get("commit", ""),
        "dirty": facts.get("dirty") == "True",
        "facts": facts,
        "versions": versions,
        "machine": {"system": platform.platform(), "processor": _processor(), "cores": os.cpu_count()},
        "engine": args.engine,
        "workers": args.workers,
        "log": args.log,
        "law_folders": list(folders),
        "laws": _laws(pushes),
        "at": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def _laws(pushes: Sequence[Push]) -> dict[str, str]:
    """Return the SHA-256 of the source of each law of one's own."""
    found: dict[str, str] = {}
    for text in {push.rig for push in pushes}:
        control = rig_from_toml(text).control
        if control.law_facts.source_sha256:
            found[control.law] = control.law_facts.source_sha256
    return dict(sorted(found.items()))


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def sources() -> list[Path]:
    """Return the source files that a push depends on."""
    folders = ("control", "safety", "sim_backend", "robot_io")
    found = [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]
    found += [ROOT / f"tools/run/{name}.py" for name in ("lockstep", "run_state", "tick_core")]
    found += sorted((ROOT / "tools/verdict").glob("*.py"))
    return [*found, ROOT / "tools/study/one_push.py", ROOT / "tools/study/pushes.py"]


def out_of(args: argparse.Namespace, study: StudyFile) -> Path:
    """Return the study's folder. Raises UsageError for --resume without one."""
    if args.resume and not args.out:
        raise UsageError("--resume needs the folder of the study to continue", do="Add --out DIR")
    return args.out or Path("studies") / f"{study.name}-{time.strftime('%Y%m%d-%H%M%S')}"
