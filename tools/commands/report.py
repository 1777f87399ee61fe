"""`push report LOG|DIR`: recreate the page of a run from its log, or draw several runs in one picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from msgspec.structs import replace

from control.laws.shipped import is_shipped
from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import EnvironmentFault, PushError, UsageError
from robot_io.log.log_format import format_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, RUN_METADATA
from robot_io.mcap.read import read_summary
from robot_io.rig.logged import rig_of_log
from tools.laws import query_law
from tools.places.find_log import find_log
from tools.replay.law import check_given, other_source
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
    parser.add_argument(
        "--law",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help="the law of a log, if it does not come with the program; once for each such law",
    )
    parser.add_argument("--json", action="store_true", help="the paths written, as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Write the report or the picture; return 0. Raises UsageError, LogDamaged, EnvironmentFault."""
    logs = [find_log(log) for log in args.log]
    for log in logs:
        check_law(log, args.law)
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


def check_law(log: Path, given: list[str]) -> None:
    """Check that the law of a log that is not a shipped one is given, and tell if its source was another one.

    Raises EnvironmentFault if it is not given, ConfigError if it cannot be used.
    """
    summary = read_summary(log)
    facts = summary.metadata.get(RUN_METADATA, {})
    try:
        config = summary.attachments.get(CONFIG_ATTACHMENT, b"").decode()
        control = rig_of_log(config, format_of(facts, str(log))).rig.control
    except (PushError, UnicodeDecodeError):
        return  # reading it will say what is wrong
    if is_shipped(control.law):
        return
    law = control.law if control.law in given else (given[-1] if given else "")
    check_given(log, control.law, law)
    today = query_law(replace(control, law=law), str(Path.cwd())).facts.source_sha256
    if words := other_source(facts, today):
        tell(f"note: {log}: made by other code ({words})")


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
