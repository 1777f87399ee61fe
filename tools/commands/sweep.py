"""`push sweep`: many simulated pushes at once; without a grid, the paper's complete simulation study."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from robot_io.error_report import say_json, tell
from robot_io.errors import OperatorStop, UsageError
from tools.study.engine import default_workers, engine, run_items
from tools.study.grid import check_law, load_grid
from tools.study.paper import paper_study
from tools.study.plan import Plan, hardware_plan, lanes_plan
from tools.terminal.arguments import name_or_path, named_path, number, pair, whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "grid", nargs="?", type=name_or_path, default="paper", help="paper (default), hardware, or a TOML grid file"
    )
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for the results (default: sweeps/NAME-TIME)"
    )
    parser.add_argument("--resume", action="store_true", help="continue the study in --out, skipping finished parts")
    parser.add_argument(
        "--gains",
        type=pair(0, 10, "K_F,K_Y"),
        metavar="K_F,K_Y",
        help="gains for all cases, for example --gains=0.1,0.3",
    )
    parser.add_argument("--law", metavar="LAW", help="the law of all cases, one of the shipped ones")
    parser.add_argument("--open-loop", action="store_true", help="the same as --law open-loop")
    parser.add_argument("--dt", type=number(1e-6, 100), metavar="S", help="simulation step in s")
    parser.add_argument(
        "--workers", type=whole_number(1, 10_000), metavar="N", help="worker processes (default: one per core)"
    )
    parser.add_argument("--engine", choices=("joblib", "dask"), default="joblib", help="what runs the work")
    parser.add_argument("--scheduler", metavar="ADDR", help="Dask scheduler, for example tcp://127.0.0.1:8786")
    parser.add_argument("--json", action="store_true", help="the summary as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Run the study and write its results; return the exit code."""
    from tools.study.store import Store, fingerprint

    began = time.monotonic()
    plan = _plan(args)
    workers = default_workers() if args.workers is None else args.workers
    if args.resume and not args.out:
        raise UsageError("--resume needs the folder of the study to continue", do="Add --out DIR")
    out = args.out or Path("sweeps") / f"{plan.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    with _terminate_as_interrupt(), engine(args.engine, args.scheduler):
        store = Store(out, plan.name, fingerprint(plan.definition, plan.sources), resume=args.resume)
        finished = store.finished(len(plan.items))
        left = [(i, item) for i, item in enumerate(plan.items) if i not in finished]
        if finished:
            tell(f"{len(finished)} of {len(plan.items)} parts are done already")
        progress = Progress(
            sum(len(item.cases) for item in plan.items), sum(len(plan.items[i].cases) for i in finished)
        )
        try:
            if left:
                plan.prepare()
            for index, part in run_items(plan.function, left, workers, local=args.engine == "joblib"):
                store.save(index, part)
                progress.add(len(part.rows))
        except KeyboardInterrupt:
            raise OperatorStop(
                f"stopped with {progress.done} of {progress.total} cases done",
                where=str(out),
                do=f"Continue with the same command and --out {out} --resume",
            ) from None
        finally:
            progress.close()
    summary, lines = plan.write(store, store.load(len(plan.items)))
    for line in lines:
        tell(line)
    tell(f"results in {out}: {', '.join(summary['files'])}")
    if args.json:
        say_json({"schema": 1, **summary, "out": str(out), "elapsed_s": round(time.monotonic() - began, 3)})
    return 0


def _plan(args: argparse.Namespace) -> Plan:
    gains = args.gains
    if args.grid == "hardware":
        return hardware_plan(gains, args.dt, bool(args.open_loop or args.law))
    changes: dict[str, Any] = {"k_f": gains[0], "k_y_rad_per_m": gains[1]} if gains else {}
    if args.open_loop and args.law not in (None, "open-loop"):
        raise UsageError("--open-loop and --law name two laws", where="push sweep", do="Give one of them")
    if law := "open-loop" if args.open_loop else args.law:
        check_law(law, "--law")
        changes["law"] = law
    if args.grid == "paper":
        return lanes_plan(paper_study(changes, args.dt))
    return lanes_plan(load_grid(Path(args.grid), changes, args.dt))


@contextlib.contextmanager
def _terminate_as_interrupt() -> Iterator[None]:
    """Make SIGTERM act as Ctrl-C: finished parts are kept and the workers end."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class Progress:
    """One line on a terminal: cases done, rate and time left; nothing if stderr is not a terminal."""

    def __init__(self, total: int, done: int) -> None:
        self.total, self.done = total, done
        self._before = done
        self._began = time.monotonic()
        self._shown = sys.stderr is not None and sys.stderr.isatty()

    def add(self, cases: int) -> None:
        """Count finished cases and update the line."""
        self.done += cases
        if self._shown:
            rate = (self.done - self._before) / max(time.monotonic() - self._began, 1e-6)
            left = (self.total - self.done) / rate
            sys.stderr.write(f"\r{self.done}/{self.total} cases, {rate:.0f} a second, {left:.0f} s left \x1b[K")
            sys.stderr.flush()

    def close(self) -> None:
        """Move on to a new line."""
        if self._shown and self.done > self._before:
            sys.stderr.write("\n")
