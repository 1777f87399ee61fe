"""`push log info|cat|export|recover LOG`: look into a log, print it, make tables of it, save a truncated one.

A log is checked to its last byte before its content is believed; a damaged one is exit code 8 with what to do.
"""

from __future__ import annotations

import argparse
import csv
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import msgspec

from robot_io.clock import NS_PER_S
from robot_io.error_report import SCHEMA, printable, say_json, tell
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.log.mcap_read import LogSummary, read_summary
from robot_io.log.mcap_recover import recover
from tools.log.decode import Decoders, columns
from tools.places.find_log import find_log


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their flags."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="info|cat|export|recover")
    info = actions.add_parser("info", help="what the log holds, with every byte checked")
    cat = actions.add_parser("cat", help="every message as one line of JSON; NaN and infinities become null")
    export = actions.add_parser("export", help="one CSV file per topic, units in the head line")
    saved = actions.add_parser("recover", help="repair a truncated log")
    for action in (info, cat, export, saved):
        action.add_argument("log", type=Path, help="run.mcap, or a run's folder")
        action.add_argument("--json", action="store_true", help="one JSON object on stdout, last")
    for action in (cat, export):
        action.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these topics")
    export.add_argument("--out", type=Path, metavar="DIR", help="directory of the tables (LOG without .mcap, and _csv)")
    saved.add_argument("--out", type=Path, metavar="FILE", help="the new log (LOG without .mcap, and _recovered.mcap)")


def run(args: argparse.Namespace) -> int:
    """Do it; raises UsageError, EnvironmentFault or LogDamaged."""
    args.log = find_log(args.log)
    actions = {"info": _info, "cat": _cat, "export": _export, "recover": _recover}
    facts = actions[args.action](args)
    if args.json:
        say_json({"schema": SCHEMA, "log": str(args.log), **facts})
    return 0


def _info(args: argparse.Namespace) -> dict[str, Any]:
    summary = read_summary(args.log)
    duration_s = (summary.end_ns - summary.start_ns) / NS_PER_S
    if not args.json:
        print(_table(args.log, summary, duration_s))
    return {
        "size_bytes": summary.size_bytes,
        "messages": summary.messages,
        "start_ns": summary.start_ns,
        "duration_s": duration_s,
        "library": summary.library,
        "channels": [
            {"topic": c.topic, "type": c.schema_name, "messages": c.messages, "latched": c.latched}
            for c in summary.channels
        ],
        "metadata": summary.metadata,
        "attachments": {name: len(data) for name, data in summary.attachments.items()},
    }


def _table(path: Path, summary: LogSummary, duration_s: float) -> str:
    width = max((len(c.topic) for c in summary.channels), default=0)
    lines = [f"{path}: {summary.size_bytes / 1e6:.2f} MB, {duration_s:.2f} s, {summary.messages} messages, whole"]
    lines += [f"  {c.topic:{width}}  {c.messages:7}  {c.schema_name}" for c in summary.channels]
    for name, values in summary.metadata.items():
        lines += [f"{name}:", *(f"  {key} = {value}" for key, value in values.items())]
    lines += [f"attached: {name}, {len(data)} bytes" for name, data in summary.attachments.items()]
    return printable("\n".join(lines))


def _cat(args: argparse.Namespace) -> dict[str, Any]:
    decoders = Decoders(read_summary(args.log), args.topics)
    count = 0
    for topic, log_time_ns, type_name, value in decoders.read(args.log):
        line = {"topic": topic, "log_time_ns": log_time_ns, "type": type_name, "message": value}
        sys.stdout.write(msgspec.json.encode(line).decode() + "\n")
        count += 1
    return {"messages": count, "unreadable": _told(decoders)}


def _export(args: argparse.Namespace) -> dict[str, Any]:
    out: Path = args.out or args.log.with_name(f"{args.log.stem}_csv")
    summary = read_summary(args.log)
    decoders = Decoders(summary, args.topics)
    try:
        if out.exists() and any(out.iterdir()):
            raise UsageError("the directory is not empty", where=str(out), do="Give another one with --out")
        out.mkdir(parents=True, exist_ok=True)
        files = _write_tables(decoders, args.log, out, summary.start_ns)
    except OSError as error:
        raise EnvironmentFault(f"the tables cannot be written: {error.strerror}", where=str(out)) from None
    for name, rows in files.items():
        tell(f"{out / name}: {rows} rows")
    return {"out": str(out), "files": files, "unreadable": _told(decoders)}


def _write_tables(decoders: Decoders, log: Path, out: Path, start_ns: int) -> dict[str, int]:
    rows: dict[str, int] = {}
    writers: dict[str, Any] = {}
    with ExitStack() as stack:
        for topic, log_time_ns, _, value in decoders.read(log):
            cells = columns(decoders.types[topic].shape, value)
            name = topic.strip("/").replace("/", "_") + ".csv"
            if topic not in writers:
                if name in rows:
                    raise UsageError(f"two topics would share {name}", do="Name one of them with --topics")
                file = stack.enter_context((out / name).open("x", newline="", encoding="utf-8"))
                writers[topic] = csv.writer(file)
                writers[topic].writerow(["log_time [ns]", "time [s]", *(column for column, _ in cells)])
                rows[name] = 0
            time_s = (log_time_ns - start_ns) / NS_PER_S
            writers[topic].writerow([log_time_ns, time_s, *(cell for _, cell in cells)])
            rows[name] += 1
    return rows


def _recover(args: argparse.Namespace) -> dict[str, Any]:
    out: Path = args.out or args.log.with_name(f"{args.log.stem}_recovered.mcap")
    saved = recover(args.log, out)
    tell(f"{out}: {saved.messages} messages saved ({saved.cause})")
    return {"out": str(out), "messages": saved.messages, "cause": saved.cause}


def _told(decoders: Decoders) -> dict[str, str]:
    for topic, why in decoders.unreadable.items():
        tell(printable(f"{topic} left out: {why}"))
    return decoders.unreadable
