"""`push sweep`: many simulated pushes at once; without a grid, the paper's whole simulation study."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import msgspec

from robot_io.error_report import say_json, tell
from robot_io.errors import OperatorStop, UsageError
from tools.study_paper import paper_study, sample_cases
from tools.sweep_engine import default_workers, engine, run_items
from tools.sweep_grid import Study, load_grid
from tools.sweep_items import COLUMNS, Part, cut, run_lane_item

ROOT = Path(__file__).resolve().parent.parent
SOURCES = tuple(ROOT / name for name in ("sim_backend/batch.py", "sim_backend/shapes.py", "tools/sweep_items.py"))
"""The program text a study's numbers come from: a study is not resumed with other text."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("grid", nargs="?", default="paper", help="`paper` (default), or a TOML grid file")
    parser.add_argument("--out", help="folder for the results (default: sweeps/NAME-TIME)")
    parser.add_argument("--resume", action="store_true", help="go on with the study in --out, skipping what is done")
    parser.add_argument("--gains", metavar="K_F,K_Y", help="gains for all cases, for example --gains=0.1,0.3")
    parser.add_argument("--open-loop", action="store_true", help="push straight along the path in all cases")
    parser.add_argument("--dt", type=float, metavar="S", help="simulation step in s")
    parser.add_argument("--workers", type=int, metavar="N", help="worker processes (default: one a core)")
    parser.add_argument("--engine", choices=("joblib", "dask"), default="joblib", help="where the work is done")
    parser.add_argument("--scheduler", metavar="ADDR", help="Dask scheduler, for example tcp://127.0.0.1:8786")
    parser.add_argument("--json", action="store_true", help="the summary as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Run the study and write its results; return the exit code."""
    from tools.sweep_store import Store, fingerprint

    began = time.monotonic()
    study = _study(args)
    workers = default_workers() if args.workers is None else args.workers
    if workers < 1:
        raise UsageError(f"--workers {workers} cannot work", do="Give at least 1")
    out = Path(args.out) if args.out else Path("sweeps") / f"{study.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    if args.resume and not args.out:
        raise UsageError("--resume needs the folder to go on with", do="Add --out DIR")
    mark = fingerprint(msgspec.to_builtins(study), SOURCES)
    with engine(args.engine, args.scheduler):
        store = Store(out, study.name, mark, resume=args.resume)
        items = cut(study)
        finished = store.finished(len(items))
        left = [(i, item) for i, item in enumerate(items) if i not in finished]
        if finished:
            tell(f"{len(finished)} of {len(items)} parts are done already")
        progress = Progress(len(study.cases), sum(len(items[i].cases) for i in finished))
        try:
            if left:
                _warm_up()
            for index, part in run_items(run_lane_item, left, workers, local=args.engine == "joblib"):
                store.save(index, part)
                progress.add(len(part.rows))
        except KeyboardInterrupt:
            raise OperatorStop(
                f"stopped with {progress.done} of {progress.total} cases done",
                where=str(out),
                do=f"Go on with the same command and --out {out} --resume",
            ) from None
        finally:
            progress.close()
    summary = _write(study, store, store.load(len(items)))
    summary |= {"out": str(out), "elapsed_s": round(time.monotonic() - began, 3)}
    if args.json:
        say_json({"schema": 1, **summary})
    return 0


def _study(args: argparse.Namespace) -> Study:
    changes: dict[str, Any] = {}
    if args.gains:
        changes |= _gains(args.gains)
    if args.open_loop:
        changes["controller"] = "open-loop"
    if args.grid == "paper":
        return paper_study(changes, args.dt)
    return load_grid(Path(args.grid), changes, args.dt)


def _gains(text: str) -> dict[str, float]:
    parts = text.split(",")
    try:
        k_f, k_y = (float(part) for part in parts)
    except ValueError:
        k_f = k_y = float("nan")
    if not (0 <= k_f <= 10 and 0 <= k_y <= 10):
        raise UsageError(
            f"`{text}` are not two gains between 0 and 10", where="--gains", do="For example --gains=0.1,0.3"
        )
    return {"k_f": k_f, "k_y_rad_per_m": k_y}


def _warm_up() -> None:
    """Compile the kernel once, here, so that the workers find it in numba's cache."""
    from sim_backend.batch import run_batch
    from sim_backend.lanes import Lane, Timing

    run_batch([Lane(True, 0.5, 0.5, 0.3, 0.5, 0.0, 0.0, 0.0)], Timing(steps=1, record_every=1))


def _write(study: Study, store: Any, parts: list[Part]) -> dict[str, Any]:
    """Write results.csv, states.npz, summary.json and the figures; return the summary."""
    import numpy as np

    from tools import sweep_figures
    from tools.sweep_summary import sentences, summarise

    rows = [row for part in parts for row in part.rows]
    states = np.concatenate([part.arrays["states"] for part in parts])
    store.write_csv("results.csv", COLUMNS, rows)
    store.write_arrays("states.npz", {"states": states})
    summary = summarise(study, rows, states)
    store.write_json("summary.json", summary)
    title = f"{study.name}: {len(study.cases)} pushes of {study.timing.steps * study.timing.dt_s:g} s"
    files = sweep_figures.save(sweep_figures.trajectories(study.cases, states, title), store.out, "trajectories")
    if chosen := sample_cases(study.cases)[:8]:
        shown = [study.cases[i] for i in chosen]
        files += sweep_figures.save(sweep_figures.samples(shown, study.timing), store.out, "samples")
    for line in sentences(summary):
        tell(line)
    tell(f"results in {store.out}: results.csv, states.npz, summary.json, {', '.join(files)}")
    return summary | {"files": ["results.csv", "states.npz", "summary.json", *files]}


class Progress:
    """One line on a terminal: cases done, rate, and the time left; nothing where no one looks."""

    def __init__(self, total: int, done: int) -> None:
        self.total, self.done = total, done
        self._before = done
        self._began = time.monotonic()
        self._shown = sys.stderr is not None and sys.stderr.isatty()

    def add(self, cases: int) -> None:
        """Count finished cases and show it."""
        self.done += cases
        if self._shown:
            rate = (self.done - self._before) / max(time.monotonic() - self._began, 1e-6)
            left = (self.total - self.done) / rate
            sys.stderr.write(f"\r{self.done}/{self.total} cases, {rate:.0f} a second, {left:.0f} s left \x1b[K")
            sys.stderr.flush()

    def close(self) -> None:
        """Leave the line."""
        if self._shown and self.done > self._before:
            sys.stderr.write("\n")
