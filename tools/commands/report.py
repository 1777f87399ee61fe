"""`push report LOG|DIR`: recreate the page of a run from its log, or draw several runs in one picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import EnvironmentFault, UsageError
from tools.places.find_log import find_log
from tools.terminal.arguments import named_path

PNG_NAMES = ("trajectory", "force", "speed", "tracking", "timing", "safety")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push report`."""
    parser.add_argument("log", nargs="+", type=named_path, help="run.mcap, or a run's folder; several with --compare")
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for report.html (default: beside the log)"
    )
    parser.add_argument("--png", action="store_true", help="also write the figures as PNG files")
    parser.add_argument(
        "--compare", type=named_path, metavar="PNG", help="draw the plan view of all logs into this new picture"
    )
    parser.add_argument("--json", action="store_true", help="the paths written, as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Write the report or the picture; return 0. Raises UsageError, LogDamaged, EnvironmentFault."""
    logs = [find_log(log) for log in args.log]
    if args.compare is not None:
        written = compare(logs, args)
    elif len(logs) > 1:
        raise UsageError("more than one log", where="push report", do="Give one, or add --compare PNG")
    else:
        written = write_page(logs[0], args)
    for path in written:
        tell(f"wrote {path}")
    if args.json:
        paths = [str(path) for path in written]
        say_json({"schema": SCHEMA, "logs": [str(log) for log in logs], "report": paths[0], "files": paths})
    return 0


def write_page(log: Path, args: argparse.Namespace) -> list[Path]:
    """Write report.html, and with --png the figures; return the paths written."""
    from tools.report.page import write_report

    out: Path = args.out or log.parent
    try:
        if args.out is not None:
            out.mkdir(parents=True, exist_ok=True)
        page = out / "report.html"
        figures = [out / f"{name}.png" for name in PNG_NAMES] if args.png else []
        # A picture beside a report belongs to it and may be overwritten with it; any other is kept.
        existing = [figure for figure in figures if figure.exists() and not page.exists()]
        if existing:
            raise UsageError("there is already a file of this name", where=str(existing[0]), do="Give another --out")
        pngs = write_report(log, page)
        for figure in figures:
            figure.write_bytes(pngs[figure.stem])
    except OSError as error:
        raise EnvironmentFault(f"the report cannot be written: {error.strerror}", where=str(out)) from None
    return [page, *figures]


def compare(logs: list[Path], args: argparse.Namespace) -> list[Path]:
    """Draw the plan view of all logs; return the path written."""
    from tools.report.plan_view import write_compare

    if args.out is not None or args.png:
        raise UsageError(
            "--compare writes one picture and nothing else", where="push report", do="Leave out --out and --png"
        )
    try:
        write_compare(logs, args.compare)
    except FileExistsError:
        raise UsageError(
            "there is already a file of this name", where=str(args.compare), do="Give another name"
        ) from None
    except OSError as error:
        raise EnvironmentFault(
            f"the picture cannot be written: {error.strerror}", where=str(args.compare), do="Check the folder"
        ) from None
    return [args.compare]
