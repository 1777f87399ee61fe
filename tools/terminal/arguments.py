"""Types of the commands' arguments: each turns a word of the command line into a value, or says why it cannot."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from collections.abc import Callable
from pathlib import Path


def name_or_path(text: str) -> str:
    """Return a name as it is, and a path with `~` replaced. Raises ArgumentTypeError for "" and for the home of nobody.

    The shell leaves the sign in `--out=~/x`, and within quotes; of a variable that is not set it leaves nothing.
    """
    if not text:
        raise ArgumentTypeError("an empty name is no file or folder; the current folder is `.`")
    if not text.startswith("~"):
        return text
    try:
        return str(Path(text).expanduser())
    except RuntimeError:
        user = Path(text).parts[0][1:]
        raise ArgumentTypeError(f"there is no user `{user}`; a file of this name is ./{text}") from None


def named_path(text: str) -> Path:
    """Return a path with `~` replaced. Raises ArgumentTypeError as `name_or_path`."""
    return Path(name_or_path(text))


MOST_LETTERS = 500


def note(text: str) -> str:
    """Return a remark of one line. Raises ArgumentTypeError for one that is too long or not printable."""
    if len(text) > MOST_LETTERS or not text.isprintable():
        raise ArgumentTypeError(f"a note is one line of at most {MOST_LETTERS} printable letters")
    return text.strip()


def number(low: float, high: float) -> Callable[[str], float]:
    """Return the type of a number from `low` to `high`, both included."""

    def read(text: str) -> float:
        value = _float(text)
        if not low <= value <= high:
            raise ArgumentTypeError(f"`{text}` is not a number from {low:g} to {high:g}")
        return value

    return read


def whole_number(low: int, high: int) -> Callable[[str], int]:
    """Return the type of a whole number from `low` to `high`, both included."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise ArgumentTypeError(f"`{text}` is not a whole number from {low} to {high}")
        return value

    return read


def pair(low: float, high: float, names: str, *, rising: bool = False) -> Callable[[str], tuple[float, float]]:
    """Return the type of two numbers from `low` to `high`, called `names` ("LOW,HIGH"); `rising`: in this order."""

    def read(text: str) -> tuple[float, float]:
        values = [_float(word) for word in text.split(",")]
        if (
            len(values) != 2
            or not all(low <= value <= high for value in values)
            or (rising and values != sorted(values))
        ):
            order = ", the lower first" if rising else ""
            raise ArgumentTypeError(f"`{text}` is not {names} with both from {low:g} to {high:g}{order}")
        return values[0], values[1]

    return read


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


SEED = whole_number(0, 2**63 - 1)
"""The largest is the largest integer that the log can hold."""
