"""The rows of a study: written as `runs.csv` and read back, chosen, sorted and shown."""

from __future__ import annotations

import csv
import math
import operator
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from robot_io.errors import UsageError

RUNS, SUMMARY, STUDY, RIG, MADE_BY, FIGURES = (
    "runs.csv", "summary.json", "study.toml", "rig.toml", "made_by.json", "figures",
)  # fmt: skip
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le, ">=": operator.ge, "!=": operator.ne, "<": operator.lt, ">": operator.gt, "=": operator.eq,
}  # fmt: skip
_CONDITION = re.compile(r"([^<>=!]+)(<=|>=|!=|<|>|=)(.*)")


class Runs(NamedTuple):
    """A table of runs: the names of its columns, and each row's cells as text."""

    columns: tuple[str, ...]
    rows: list[dict[str, str]]


def read_runs(folder: Path) -> Runs:
    """Read the table of a study's folder. Raises UsageError where there is none."""
    path = folder / RUNS
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            rows = [{key: value or "" for key, value in row.items() if key is not None} for row in reader]
            return Runs(tuple(reader.fieldnames or ()), rows)
    except (OSError, UnicodeDecodeError, csv.Error):
        raise UsageError(
            f"there is no {RUNS}", where=str(folder), do="Give the folder of a finished `push study`"
        ) from None


def chosen(runs: Runs, conditions: Sequence[str]) -> Runs:
    """Return the rows that meet every condition: `key=value`, `key!=value`, `key<number` and so on; |key|: its size.

    Raises UsageError for a condition that cannot be read, or a column that is not there.
    """
    rows = runs.rows
    for condition in conditions:
        found = _CONDITION.fullmatch(condition)
        if found is None:
            raise UsageError(
                f"`{condition}` is no condition", where="--where", do="For example: --where verdict=done, or 'lost_s>1'"
            )
        key, sign, wanted = found[1].strip(), found[2], found[3].strip()
        name = check_column(runs, key.strip("|"), "--where")
        rows = [row for row in rows if _meets(row[name], sign, wanted, key != name)]
    return Runs(runs.columns, rows)


def check_column(runs: Runs, name: str, option: str) -> str:
    """Return a column's full name, for which the end of it will do. Raises UsageError for one that is not there."""
    ends = [column for column in runs.columns if column == name or column.endswith(f".{name}")]
    if name in runs.columns:
        return name
    if len(ends) == 1:
        return ends[0]
    raise UsageError(f"there is no column `{name}`", where=option, do=f"Columns: {', '.join(runs.columns)}")


def in_order(runs: Runs, key: str, *, falling: bool = False) -> Runs:
    """Return the rows sorted by a column, |key|: by size; cells without a value come last. Raises UsageError."""
    name = check_column(runs, key.strip("|"), "--sort")

    def place(row: dict[str, str]) -> tuple[bool, float]:
        value = abs(number(row[name])) if key.startswith("|") else number(row[name])
        return math.isnan(value), 0.0 if math.isnan(value) else (-value if falling else value)

    if all(math.isnan(number(row[name])) for row in runs.rows):
        return Runs(runs.columns, sorted(runs.rows, key=lambda row: row[name], reverse=falling))
    return Runs(runs.columns, sorted(runs.rows, key=place))


def groups(runs: Runs, keys: Sequence[str]) -> dict[tuple[str, ...], list[dict[str, str]]]:
    """Return the rows by the values of some columns, in the order in which they first appear. Raises UsageError."""
    names = [check_column(runs, key, "--by") for key in keys]
    found: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in runs.rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return found


def number(cell: str) -> float:
    """Return a cell as a number, NaN where it is none."""
    try:
        return float(cell)
    except ValueError:
        return math.nan


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines of aligned cells, numbers to the right."""
    widths = [max(len(cells[i]) for cells in (heads, *rows)) for i in range(len(heads))]
    right = [all(not row[i] or not math.isnan(number(row[i])) for row in rows) for i in range(len(heads))]
    return ["  ".join(map(_padded, cells, widths, right)).rstrip() for cells in (heads, *rows)]


def _padded(cell: str, width: int, right: bool) -> str:
    return cell.rjust(width) if right else cell.ljust(width)


def _meets(cell: str, sign: str, wanted: str, size: bool) -> bool:
    left, right = number(cell), number(wanted)
    if math.isnan(left) or math.isnan(right):
        return (cell == wanted) == (sign == "=") if sign in ("=", "!=") else False
    return _COMPARISONS[sign](abs(left) if size else left, right)
