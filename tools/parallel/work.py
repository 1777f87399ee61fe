"""Run what is left of a study's work, keeping each part as it comes, with one line of progress on a terminal."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from robot_io.error_report import tell
from robot_io.errors import OperatorStop
from tools.parallel.engine import default_workers, engine, run_items
from tools.parallel.part import Part
from tools.terminal.arguments import whole_number

if TYPE_CHECKING:
    from tools.parallel.store import Store


class Work(NamedTuple):
    """Items, each with its `.cases`; the function that makes a part of one; and what is done once before them."""

    items: Sequence[Any]
    function: Callable[[Any], Part]
    prepare: Callable[[], None]


def add_work_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what runs the work: --workers, --engine and --scheduler."""
    parser.add_argument(
        "--workers", type=whole_number(1, 10_000), metavar="N", help="worker processes (default: one per core)"
    )
    parser.add_argument("--engine", choices=("joblib", "dask"), default="joblib", help="what runs the work")
    parser.add_argument("--scheduler", metavar="ADDR", help="Dask scheduler, for example tcp://127.0.0.1:8786")


@contextlib.contextmanager
def working(args: argparse.Namespace) -> Iterator[None]:
    """Have the engine of the arguments ready, and take SIGTERM as Ctrl-C. Raises as `engine`."""
    with _terminate_as_interrupt(), engine(args.engine, args.scheduler):
        yield


def run_parts(store: Store, work: Work, args: argparse.Namespace, *, where: Path) -> None:
    """Run the items that `store` has no part of. where: the folder. Raises OperatorStop: Ctrl-C or SIGTERM."""
    items = work.items
    finished = store.finished(len(items))
    left = [(i, item) for i, item in enumerate(items) if i not in finished]
    if finished:
        tell(f"{len(finished)} of {len(items)} parts are done already")
    progress = Progress(sum(len(item.cases) for item in items), sum(len(items[i].cases) for i in finished))
    workers = default_workers() if args.workers is None else args.workers
    try:
        if left:
            work.prepare()
        for index, part in run_items(work.function, left, workers, local=args.engine == "joblib"):
            store.save(index, part)
            progress.add(len(part.rows))
    except KeyboardInterrupt:
        raise OperatorStop(
            f"stopped with {progress.done} of {progress.total} cases done",
            where=str(where),
            do=f"Continue with the same command and --out {where} --resume",
        ) from None
    finally:
        progress.close()


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
