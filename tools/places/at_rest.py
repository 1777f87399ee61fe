"""A log that comes out of a pipe, kept in a file while it is read: a log is read more than once."""

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


def comes_once(named: Path) -> bool:
    """Return whether it can be read only once: a pipe or a device."""
    try:
        mode = named.stat().st_mode
    except OSError:
        return False  # whoever opens it says what is wrong
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextmanager
def at_rest(named: Path) -> Iterator[Path]:
    """Yield `named`, or for a pipe or a device a temporary copy of what comes out of it.

    Errors raised meanwhile speak of `named`. Raises UsageError when it cannot be read, EnvironmentFault when the copy
    cannot be written.
    """
    if not comes_once(named):
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
                if block.startswith(MAGIC):  # what is no log may have no end
                    shutil.copyfileobj(source, target, _BLOCK_BYTES)
        except OSError as error:
            raise EnvironmentFault(
                f"what comes out of the pipe cannot be kept: {error.strerror}",
                where=str(copy.parent),
                do="Make room, or save the log to a file elsewhere and name that",
            ) from None
