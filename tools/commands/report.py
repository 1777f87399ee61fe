"""`push report LOG|DIR...`: the page of a run from its log, or one page that compares several runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from control.laws.shipped import is_shipped
from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import EnvironmentFault, PushError, UsageError
from robot_io.log.log_format import format_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, RUN_METADATA
from robot_io.mcap.read import read_summary
from robot_io.rig.logged import rig_of_log
from tools.laws import query_law
from tools.replay.law import check_given, other_source
from tools.terminal.arguments import named_path

if TYPE_CHECKING:
    from tools.report.compare.given_runs import ComparedRun

FILMS = ("film.gif", "film.mp4")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push report`."""
    parser.add_argument(
        "log", nargs="+", type=named_path, help="run.mcap, a run's folder or a folder of trials; several are compared"
    )
    parser.add_argument(
        "--out", type=named_path, metavar="DIR",
        help="folder to write to (default: beside the log; for several runs compare-TIME)",
    )  # fmt: skip
    parser.add_argument("--png", action="store_true", help="also write the figures as PNG files")
    parser.add_argument(
        "--gif", action="store_true", help="also write film.gif: the pushes from above, four times as fast"
    )
    parser.add_argument("--mp4", action="store_true", help="the same as film.mp4 (needs ffmpeg)")
    parser.add_argument(
        "--law",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help="the law of a log, if it does not come with the program; once for each such law",
    )
    parser.add_argument("--compare", type=named_path, help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help="the paths written, as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Write the report or the comparison; return 0. Raises UsageError, LogDamaged, EnvironmentFault."""
    from tools.report.compare.given_runs import logs_of

    if args.compare is not None:
        raise UsageError(
            "--compare is no longer needed", where="push report", do="Several runs are compared; --out names the folder"
        )
    if args.mp4:
        from tools.report.film.mp4 import find_ffmpeg

        find_ffmpeg()
    logs = logs_of(args.log)
    for log in logs:
        check_law(log, args.law)
    written = write_page(logs[0], args) if len(logs) == 1 else compare(logs, args)
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
    """Write report.html, with --png the figures, and the films asked for; return the paths written."""
    from tools.report.compare.given_runs import read_runs
    from tools.report.page import write_report

    out: Path = args.out or log.parent
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(
            f"the report cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    kept = [out / name for name in FILMS if (out / name).exists() and not (out / "report.html").exists()]
    if kept and (args.gif or args.mp4):
        raise UsageError("there is already a file of this name", where=str(kept[0]), do="Give another --out")
    written = write_report(log, out / "report.html", png=args.png)
    return [*written, *(films(read_runs([log]), out, args) if args.gif or args.mp4 else [])]


def compare(logs: list[Path], args: argparse.Namespace) -> list[Path]:
    """Write the page, picture and table of several runs, and the films asked for; return the paths written."""
    from tools.report.compare.given_runs import path_notes, read_runs
    from tools.report.compare.write import folder_for, write_comparison

    runs = read_runs(logs)
    out = folder_for(args.out)
    for note in path_notes(runs):
        tell(note)
    return [*write_comparison(runs, out, as_png=args.png), *films(runs, out, args)]


def films(runs: list[ComparedRun], out: Path, args: argparse.Namespace) -> list[Path]:
    """Write the films asked for; return their paths."""
    from tools.report.film.gif import write_gif
    from tools.report.film.mp4 import write_mp4

    written = []
    for wanted, name, write in zip((args.gif, args.mp4), FILMS, (write_gif, write_mp4), strict=True):
        if wanted:
            write(runs, out / name)
            written.append(out / name)
    return written
