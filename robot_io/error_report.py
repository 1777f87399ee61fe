"""How the program tells a person, or with `--json` a script, what went wrong."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterator

from robot_io.errors import PushError

SCHEMA = 1


def tell(text: str) -> None:
    """Print one line of people's text on stderr, if there is one and it takes it (its terminal may be closed)."""
    if sys.stderr is not None:  # print(file=None) would go to stdout
        with contextlib.suppress(OSError):
            print(text, file=sys.stderr, flush=True)


def printable(text: str) -> str:
    """Return text that may come out of a file or a log without what a terminal would act on; lines stay lines."""
    return "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)


def say_json(value: object) -> None:
    """Print `value` as one line of JSON on stdout, flushed; ValueError for a number that is not finite."""
    if sys.stdout is not None:
        print(json.dumps(value, allow_nan=False), flush=True)


@contextlib.contextmanager
def ignoring_output_errors() -> Iterator[None]:
    """Lose what is printed on stdout in here when nobody takes it (a closed pipe or terminal, a full disk)."""
    try:
        yield
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        discard_stdout()


def discard_stdout() -> None:
    """Send stdout nowhere: Python flushes it once more at exit, and would end with a code of its own."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)


def report(error: PushError, *, as_json: bool) -> int:
    """Tell about `error` in one sentence, with `--json` also as the last line of stdout; return the exit code."""
    tell(printable(f"push: {error}"))
    if as_json:
        with ignoring_output_errors():
            say_json({"schema": SCHEMA, "error": error.as_json()})
    return error.exit_code


def unexpected(error: BaseException) -> PushError:
    """Turn a defect of the program into a sentence that says where its traceback was written."""
    import tempfile  # here, because few programs of ours ever need them
    import traceback

    trace = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="push-error-", suffix=".txt", delete=False, encoding="utf-8", errors="replace"
        ) as file:
            file.write(trace)
            place = file.name
    except OSError:
        tell(trace)
        place = "the lines above"
    summary = " ".join(f"{type(error).__name__}: {error}".split())
    return PushError(f"unexpected {summary}", do=f"This is a bug in the program; its traceback is in {place}")
