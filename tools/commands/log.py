"""`push log info|cat|export|recover|zip`: inspect a log, print or export it, repair a truncated one, pack runs.

A log is verified to its last byte before its content is used; a damaged one ends with exit code 8 and what to do.
"""

from __future__ import annotations

import argparse
import csv
import shutil
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec

from robot_io.clock import NS_PER_S
from robot_io.error_report import SCHEMA, printable, say_json, tell
from robot_io.errors import EnvironmentFault, LogDamaged, UsageError
from robot_io.log.recovery import recover
from robot_io.mcap.files import files_of, has_parts, part_path
from robot_io.mcap.read import LogSummary, read_summary
from tools.commands import log_zip
from tools.log.decode import Decoders, columns
from tools.log.signal_table import WRITERS, signal_rows
from tools.places.find_log import find_log
from tools.places.stream_file import as_file, is_stream
from tools.terminal.arguments import named_path

STANDARD_INPUT = Path("/dev/stdin")
DO_OTHER_TOOL = "Read it with the tool that wrote it; `push log info` lists all topics that cannot be read here"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their flags."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="info|cat|export|recover|zip")
    info = actions.add_parser("info", help="show what the log holds, with every byte verified")
    cat = actions.add_parser("cat", help="print every message as one line of JSON; NaN and infinities become null")
    export = actions.add_parser("export", help="write one CSV file per topic, units in the header line")
    saved = actions.add_parser("recover", help="repair a truncated log")
    log_zip.add_arguments(actions.add_parser("zip", help="pack runs for others, without addresses and names"))
    for action in (info, cat, export, saved):
        action.add_argument("log", type=named_path, help="run.mcap, a run's folder, or - for a pipe")
        action.add_argument("--json", action="store_true", help="one JSON object on stdout, last")
    for action in (cat, export):
        action.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these topics")
    export.add_argument(
        "--signals",
        action="store_true",
        help="one table instead, of /control/signals: what one plots, a row for each tick",
    )
    export.add_argument("--to", choices=("csv", "parquet"), default="csv", help="parquet: with --signals only")
    export.add_argument(
        "--out",
        type=named_path,
        metavar="PATH",
        help="folder for the tables (default: LOG without .mcap, plus _csv); with --signals the file",
    )
    saved.add_argument(
        "--out", type=named_path, metavar="FILE", help="the new log (default: LOG without .mcap, plus _recovered.mcap)"
    )


def run(args: argparse.Namespace) -> int:
    """Run the action; return 0. Raises UsageError, EnvironmentFault or LogDamaged."""
    if args.action == "zip":
        facts = log_zip.run(args)
        if args.json:
            say_json({"schema": SCHEMA, "log": str(args.log), **facts})
        return 0
    args.named = STANDARD_INPUT if args.log == Path("-") else find_log(args.log)
    actions = {"info": _info, "cat": _cat, "export": _export, "recover": _recover}
    unnamed = args.named == STANDARD_INPUT or is_stream(args.named)
    if unnamed and args.action in ("export", "recover") and args.out is None:
        raise UsageError("a log from a pipe has no file name to name the output after", do="Name the result with --out")
    with as_file(args.named) as args.log:
        facts = actions[args.action](args)
    if args.json:
        say_json({"schema": SCHEMA, "log": str(args.named), **facts})
    return 0


def _info(args: argparse.Namespace) -> dict[str, Any]:
    summary = read_summary(args.log)
    duration_s = (summary.end_ns - summary.start_ns) / NS_PER_S
    unreadable = Decoders(summary, None).unreadable
    files = [file.name for file in files_of(args.log)]
    if not args.json:
        print(_table(args.named, summary, duration_s, unreadable))
        if len(files) > 1:
            print(f"in {len(files)} parts: {files[0]} to {files[-1]}")
    return {
        **({"parts": files} if len(files) > 1 else {}),
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
        "unreadable": unreadable,
    }


def _table(path: Path, summary: LogSummary, duration_s: float, unreadable: dict[str, str]) -> str:
    width = max((len(c.topic) for c in summary.channels), default=0)
    lines = [f"{path}: {summary.size_bytes / 1e6:.2f} MB, {duration_s:.2f} s, {summary.messages} messages, intact"]
    lines += [f"  {c.topic:{width}}  {c.messages:7}  {c.schema_name or '-'}" for c in summary.channels]
    lines += [f"{topic} cannot be read: {why}" for topic, why in unreadable.items()]
    for name, values in summary.metadata.items():
        lines += [f"{name}:", *(f"  {key} = {value}" for key, value in values.items())]
    lines += [f"attached: {name}, {len(data)} bytes" for name, data in summary.attachments.items()]
    return printable("\n".join(lines))


def _cat(args: argparse.Namespace) -> dict[str, Any]:
    decoders = Decoders(read_summary(args.log), args.topics)
    count = 0
    for topic, log_time_ns, type_name, _, value in decoders.read(args.log):
        line = {"topic": topic, "log_time_ns": log_time_ns, "type": type_name, "message": value}
        sys.stdout.write(msgspec.json.encode(line).decode() + "\n")
        count += 1
    return {"messages": count, "unreadable": _report_unreadable(decoders, args, count)}


def _export(args: argparse.Namespace) -> dict[str, Any]:
    if args.signals:
        return _export_signals(args)
    if args.to != "csv":
        raise UsageError(
            "one table for each topic is CSV", do="Add --signals for one table as Parquet, or leave out --to"
        )
    out: Path = args.out or args.log.with_name(f"{args.log.stem}_csv")
    summary = read_summary(args.log)
    decoders = Decoders(summary, args.topics)
    try:
        if out.exists() and any(out.iterdir()):
            raise UsageError("the directory is not empty", where=str(out), do="Give another one with --out")
        made = not out.exists()
        out.mkdir(parents=True, exist_ok=True)
        files: dict[str, int] = {}
        with _removed_on_failure(out, files, made=made):
            _write_tables(decoders, args.log, out, summary.start_ns, files)
    except OSError as error:
        raise EnvironmentFault(
            f"the tables cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    for name, rows in files.items():
        tell(f"{out / name}: {rows} rows")
    return {"out": str(out), "files": files, "unreadable": _report_unreadable(decoders, args, sum(files.values()))}


def _export_signals(args: argparse.Namespace) -> dict[str, Any]:
    out: Path = args.out or args.log.with_name(f"{args.log.stem}_signals.{args.to}")
    if args.topics:
        raise UsageError("--signals is one topic", do="Leave out --topics")
    if out.exists():
        raise UsageError("it exists already", where=str(out), do="Give another one with --out")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        try:
            rows = WRITERS[args.to](out, signal_rows(args.log))
        except BaseException:  # half a table would block the next one
            out.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise EnvironmentFault(
            f"the table cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    tell(f"{out}: {rows} rows")
    return {"out": str(out), "rows": rows}


@contextmanager
def _removed_on_failure(out: Path, files: dict[str, int], *, made: bool) -> Iterator[None]:
    """Remove the files from `out`, and the folder if it was made for them: half an export would block the next."""
    try:
        yield
    except BaseException:
        for name in files:
            (out / name).unlink(missing_ok=True)
        if made:
            with suppress(OSError):  # something else is in it
                out.rmdir()
        raise


def _write_tables(decoders: Decoders, log: Path, out: Path, start_ns: int, rows: dict[str, int]) -> None:
    """Write the tables; `rows` counts what is in each file."""
    names: dict[tuple[str, str], str] = {}
    writers: dict[tuple[str, str], Any] = {}
    with ExitStack() as stack:
        for topic, log_time_ns, type_name, shape, value in decoders.read(log):
            cells = columns(shape, value)
            table = (topic, type_name)
            if table not in writers:
                # Only a log from other software has several types on one topic.
                several = any(topic == other for other, _ in writers)
                name = f"{topic} {type_name}" if several else topic
                names[table] = name.strip("/").replace("/", "_").replace(" ", ".") + ".csv"
                if names[table] in rows:
                    raise UsageError(f"two topics would share {names[table]}", do="Name one of them with --topics")
                file = stack.enter_context((out / names[table]).open("x", newline="", encoding="utf-8"))
                rows[names[table]] = 0
                writers[table] = csv.writer(file)
                writers[table].writerow(["log_time [ns]", "time [s]", *(column for column, _ in cells)])
            time_s = (log_time_ns - start_ns) / NS_PER_S
            writers[table].writerow([log_time_ns, time_s, *(cell for _, cell in cells)])
            rows[names[table]] += 1


def _recover(args: argparse.Namespace) -> dict[str, Any]:
    out: Path = args.out or args.log.with_name(f"{args.log.stem}_recovered.mcap")
    if has_parts(args.log):
        return _recover_parts(args.log, out)
    saved = recover(args.log, out)
    tell(f"{out}: {saved.messages} messages saved ({saved.cause})")
    return {"out": str(out), "messages": saved.messages, "cause": saved.cause}


def _recover_parts(log: Path, out: Path) -> dict[str, Any]:
    """Repair the parts that need it, and copy the others. Raises UsageError if none does, and as `recover`."""
    messages, causes = 0, dict[str, str]()
    files, made = files_of(log), list[Path]()
    try:
        for number, file in enumerate(files, 1):
            target = part_path(out, number)
            try:
                messages += read_summary(file).messages
            except LogDamaged:
                try:
                    saved = recover(file, target)
                except LogDamaged as damage:
                    if number == 1 or number < len(files):
                        raise
                    causes[file.name] = damage.what  # it had only just begun: there is nothing in it
                    continue
                messages += saved.messages
                causes[file.name] = saved.cause
            else:
                _copy_new(file, target)
            made.append(target)
        if not causes:
            raise UsageError("the log is intact; there is nothing to recover", where=str(log))
    except BaseException:
        for target in made:
            target.unlink(missing_ok=True)
        raise
    words = "; ".join(f"{name}: {cause}" for name, cause in causes.items())
    tell(f"{made[0]} to {made[-1].name}: {messages} messages saved ({words})")
    return {"out": str(out), "parts": [one.name for one in made], "messages": messages, "cause": words}


def _copy_new(file: Path, target: Path) -> None:
    if target.exists():
        raise UsageError("there is already a file of this name", where=str(target), do="Give another name with --out")
    try:
        shutil.copyfile(file, target)
    except OSError as error:
        target.unlink(missing_ok=True)
        raise EnvironmentFault(
            f"the log cannot be written: {error.strerror}", where=str(target), do="Give another --out"
        ) from None


def _report_unreadable(decoders: Decoders, args: argparse.Namespace, messages: int) -> dict[str, str]:
    """Print and return what could not be read. Raises LogDamaged if --topics named it or nothing else is there."""
    wanted = [topic for topic in decoders.unreadable if topic in (args.topics or ()) or messages == 0]
    for topic, why in decoders.unreadable.items():
        if topic not in wanted[:1]:
            tell(printable(f"{topic} left out: {why}"))
    if wanted:
        what = f"{wanted[0]} cannot be read: {decoders.unreadable[wanted[0]]}"
        raise LogDamaged(what, where=str(args.log), do=DO_OTHER_TOOL)
    return decoders.unreadable
