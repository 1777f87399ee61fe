"""`push study show DIR`: the table of a study, filtered, sorted or summed up by columns."""

from __future__ import annotations

import argparse
from typing import Any

from robot_io.error_report import say_json
from robot_io.errors import UsageError
from tools.study.one_push import FIXED_AFTER, FIXED_BEFORE
from tools.study.results import Runs, chosen, groups, in_order, number, read_runs, table
from tools.study.summary import figures
from tools.terminal.arguments import named_path, whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("folder", metavar="DIR", type=named_path, help="folder of a finished study")
    parser.add_argument(
        "--where", action="append", default=[], metavar="CONDITION",
        help="only runs with, for example, verdict=done, 'lost_s>1', '|end_lateral_m|>0.1'; may be repeated",
    )  # fmt: skip
    parser.add_argument("--sort", metavar="COLUMN", help="sort by a column; '|COLUMN|': by its size, without the sign")
    parser.add_argument("--reverse", action="store_true", help="largest first")
    parser.add_argument("--by", metavar="COLUMNS", help="one line for each value of these columns (comma between)")
    parser.add_argument("--limit", type=whole_number(1, 10_000_000), metavar="N", help="at most this many lines")
    parser.add_argument("--json", action="store_true", help="as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Print the table; return the exit code."""
    runs = chosen(read_runs(args.folder), args.where)
    if args.by and args.sort:
        raise UsageError("--by has its own order", where="push study show", do="Leave out --sort")
    if args.sort:
        runs = in_order(runs, args.sort, falling=args.reverse)
    found = summed(runs, args.by.split(",")) if args.by else plain(runs)
    found = found[: args.limit] if args.limit else found
    if args.json:
        say_json({"schema": 1, "runs": len(runs.rows), "rows": found})
        return 0
    if not found:
        print("no run meets the conditions")
        return 0
    heads = list(found[0])
    for line in table([_head(head) for head in heads], [[_cell(row[head]) for head in heads] for row in found]):
        print(line)
    return 0


def plain(runs: Runs) -> list[dict[str, Any]]:
    """Return the runs as they are."""
    return [dict(row) for row in runs.rows]


def summed(runs: Runs, keys: list[str]) -> list[dict[str, Any]]:
    """Return one row for each value of some columns: how many were done, and what their offsets were in cm."""
    rows = []
    for values, members in groups(runs, keys).items():
        found = figures(members)
        done = found["verdicts"].get("done", {"runs": 0})["runs"]
        lost = sum(int(row["exit_code"]) == 6 for row in members)
        rows.append(
            {
                **dict(zip(keys, values, strict=True)),
                "runs": len(members),
                "done": done,
                "lost": lost,
                "end median cm": _cm(found["end_lateral_m"], "median"),
                "low": _cm(found["end_lateral_m"], "low"),
                "high": _cm(found["end_lateral_m"], "high"),
                "end 95 % cm": _cm(found["end_lateral_m"], "p95"),
                "worst 95 % cm": _cm(found["worst_lateral_m"], "p95"),
            }
        )
    return rows


def _cm(spread: dict[str, float] | None, key: str) -> float | None:
    return None if spread is None else round(100 * spread[key], 1) + 0.0  # no "-0.0"


def _head(name: str) -> str:
    return name if name in (*FIXED_BEFORE, *FIXED_AFTER) else name.rpartition(".")[2]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.1f}"
    text = str(value)
    return f"{number(text):.4g}" if "." in text and number(text) == number(text) else text
