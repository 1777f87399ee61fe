"""Copy a log from a pipe into a temporary file: a log is read more than once."""

from __future__ import annotations

import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robot_io.errors import EnvironmentFault, PushError, UsageError
from robot_io.mcap.walk import MAGIC

_BLOCK_BYTES = 1 << 20


def is_stream(named: Path) -> bool:
    """Return whether `named` can be read only once: a pipe or a device."""
    try:
        mode = named.stat().st_mode
    except OSError:
        return False  # opening it will say what is wrong
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextmanager
def as_file(named: Path) -> Iterator[Path]:
    """Yield `named`, or for a pipe or a device a temporary copy of its content.

    Errors raised in the block name `named`. Raises UsageError if it cannot be read, EnvironmentFault if the copy cannot
    be written.
    """
    if not is_stream(named):
        yield named
        return
    with tempfile.TemporaryDirectory(prefix="push-log-") as folder:
        copy = Path(folder) / named.name
        _copy(named, copy)
        try:
            yield copy
        except PushError as error:
            error.where = error.where.replace(str(copy), str(named))
            error.do = error.do.replace(str(copy), str(named))
            raise


def _copy(named: Path, copy: Path) -> None:
    try:
        source = named.open("rb")
    except OSError as error:
        raise UsageError(f"the log cannot be read: {error.strerror}", where=str(named)) from None
    with source:
        try:
            with copy.open("wb") as target:
                block = source.read(_BLOCK_BYTES)
                target.write(block)
                if block.startswith(MAGIC):  # anything but a log may never end
                    shutil.copyfileobj(source, target, _BLOCK_BYTES)
        except OSError as error:
            raise EnvironmentFault(
                f"the content of the pipe cannot be saved: {error.strerror}",
                where=str(copy.parent),
                do="Free some space, or save the log to a file elsewhere and name that file",
            ) from None
