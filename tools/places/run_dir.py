"""The folder of a run: created, never overwritten."""

from __future__ import annotations

import contextlib
import errno
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from robot_io.errors import UsageError
from robot_io.mcap.files import files_of, has_parts
from robot_io.rig.config import RigConfig, rig_to_toml
from tools.places.atomic_file import check_writable

MAX_RUNS_PER_SECOND = 1000
LOG = "run.mcap"
RUN_FILES = (LOG, "config.toml", "summary.json", "processes.json", "report.html")


def create(out: Path | None, rig_name: str) -> Path:
    """Create and return the run's folder (default: `runs/RIG-TIME`, with a number if that exists).

    Raises UsageError if it already holds a run or cannot be created.
    """
    path = out or Path("runs") / f"{rig_name}-{time.strftime('%Y%m%d-%H%M%S')}"
    try:
        if out and (any((path / name).exists() for name in RUN_FILES) or has_parts(path / LOG)):
            raise UsageError("this folder already holds a run", where=str(path), do="Give another --out")
        path = _make_folder(path, given=bool(out))
        try:
            check_writable(path)
        except KeyboardInterrupt:
            discard(path)
            raise
    except OSError as error:
        raise UsageError(
            f"the run's folder cannot be written: {error.strerror}", where=str(path), do="Give another --out"
        ) from None
    return path


def _make_folder(path: Path, *, given: bool) -> Path:
    """Create and return the folder; a default one must be new, because runs may start within the same second."""
    if given:
        path.mkdir(parents=True, exist_ok=True)
        return path
    for number in range(1, MAX_RUNS_PER_SECOND):
        numbered = path if number == 1 else path.with_name(f"{path.name}-{number}")
        with contextlib.suppress(FileExistsError):
            numbered.mkdir(parents=True)
            return numbered
    raise FileExistsError(errno.EEXIST, "too many runs at the same time", str(path))


@contextlib.contextmanager
def discarded_unless(path: Path, begun: Callable[[], bool]) -> Iterator[None]:
    """Discard the folder where this ends in any exception, the operator's interrupt too, unless the run has begun."""
    try:
        yield
    except BaseException:
        if not begun():
            discard(path)
        raise


def discard(path: Path) -> None:
    """Remove the files of a run that did not start, and the folder if nothing else is in it."""
    for file in (*files_of(path / LOG), *(path / name for name in RUN_FILES)):
        file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        path.rmdir()


def write_config(path: Path, rig: RigConfig) -> str:
    """Write the resolved rig to `config.toml` and return its text."""
    text = rig_to_toml(rig)
    (path / "config.toml").write_text(text, encoding="utf-8")
    return text
