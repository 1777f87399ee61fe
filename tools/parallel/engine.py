"""Run a study's items on this machine's cores or on a Dask cluster, and yield each result as it arrives."""

from __future__ import annotations

import contextlib
import os
import signal
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from robot_io.errors import EnvironmentFault, PushError, UsageError

Item = TypeVar("Item")
Result = TypeVar("Result")

SCHEDULER_TIMEOUT_S = 5.0
CLUSTER_TIMEOUT_S = 60.0
"""How long a scheduler may have no worker: clusters start workers on demand."""


def default_workers() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0))


@contextlib.contextmanager
def engine(name: str, scheduler: str | None) -> Iterator[None]:
    """Make joblib send its work to the named engine: `joblib` (processes here) or `dask` (a running scheduler).

    Raises UsageError for `dask` without a scheduler, EnvironmentFault if the package or the scheduler is missing.
    """
    if name == "joblib":
        if scheduler:
            raise UsageError("--scheduler belongs to --engine dask", do="Add --engine dask")
        yield
        return
    if not scheduler:
        raise UsageError("--engine dask needs the scheduler's address", do="Add --scheduler tcp://HOST:PORT")
    try:
        import distributed
    except ImportError:
        raise EnvironmentFault(
            "dask.distributed is not installed", do="Run `make dev` in the program's folder"
        ) from None
    import joblib

    connect: Any = distributed.Client  # distributed is untyped
    try:
        client = connect(scheduler, timeout=SCHEDULER_TIMEOUT_S, set_as_default=True)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise EnvironmentFault(
            f"no Dask scheduler responds: {reason}", where=scheduler, do="Start one with `dask scheduler`"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CLUSTER_TIMEOUT_S)
        except TimeoutError:
            raise EnvironmentFault(
                f"the Dask scheduler has no worker after {CLUSTER_TIMEOUT_S:.0f} s",
                where=scheduler,
                do=f"Start one with `dask worker {scheduler}`",
            ) from None
        with joblib.parallel_config("dask"):
            yield


def run_items(
    function: Callable[[Item], Result], items: Sequence[tuple[int, Item]], workers: int, *, local: bool
) -> Iterator[tuple[int, Result]]:
    """Yield (number, function(item)) as the items finish, in any order. `local`: on this machine's cores.

    One worker runs in this process. Leaving early (an error, Ctrl-C) ends the worker processes.
    """
    if local and (workers == 1 or len(items) <= 1):
        for number, item in items:
            yield number, function(item)
        return
    import joblib
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    pool: Any = joblib.Parallel(
        n_jobs=workers if local else -1, batch_size=1, return_as="generator_unordered", pre_dispatch="2*n_jobs",
        **({"initializer": _ignore_sigint} if local else {}),
    )  # fmt: skip
    with warnings.catch_warnings():
        # leaving early is intended: joblib warns that it cancels pending work
        warnings.simplefilter("ignore", UserWarning)
        results = pool(joblib.delayed(_numbered)(function, number, item) for number, item in items)
        try:
            yield from results
        except TerminatedWorkerError:
            raise PushError(
                "a worker process died (out of memory?)",
                do="Continue with --resume, perhaps with fewer --workers",
            ) from None
        except BaseException:
            if local:
                _end_workers()
            raise
        finally:
            results.close()


def _ignore_sigint() -> None:
    """Ignore SIGINT in a worker: a terminal sends it to workers too, and an idle one would print a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _numbered(function: Callable[[Item], Result], number: int, item: Item) -> tuple[int, Result]:
    return number, function(item)


def _end_workers() -> None:
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True, kill_workers=True)
