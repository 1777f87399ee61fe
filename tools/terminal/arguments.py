"""Types of the commands' arguments: each turns a word of the command line into a value, or says why it cannot."""

from __future__ import annotations

from argparse import ArgumentTypeError
from pathlib import Path


def name_or_path(text: str) -> str:
    """Return a name as it is, and a path with `~` replaced. Raises ArgumentTypeError for the home of nobody.

    The shell leaves the sign in `--out=~/x`, and within quotes.
    """
    if not text.startswith("~"):
        return text
    try:
        return str(Path(text).expanduser())
    except RuntimeError:
        user = Path(text).parts[0][1:]
        raise ArgumentTypeError(f"there is no user `{user}`; a file of this name is ./{text}") from None


def named_path(text: str) -> Path:
    """Return a path with `~` replaced. Raises ArgumentTypeError for the home of nobody."""
    return Path(name_or_path(text))
