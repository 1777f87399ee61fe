"""`push study rerun DIR`: run a study again and compare: the same bytes, or what differs."""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from robot_io.error_report import say_json, tell
from robot_io.errors import ReplayDiffers, UsageError
from tools.parallel.work import add_work_arguments, working
from tools.run.facts.run_facts import code_and_machine
from tools.study.plan import run_study
from tools.study.results import MADE_BY, RIG, RUNS, STUDY, Runs, read_runs
from tools.study.study_file import StudyFile, read_study
from tools.terminal.arguments import named_path

MOST_TOLD = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("folder", metavar="DIR", type=named_path, help="folder of a finished study")
    parser.add_argument("--out", type=named_path, metavar="DIR", help="keep what is run again here (default: nowhere)")
    add_work_arguments(parser)
    parser.add_argument("--json", action="store_true", help="the outcome as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Run the study of a folder again; return the exit code. Raises ReplayDiffers where the rows differ."""
    study, made = study_of(args.folder)
    before = read_runs(args.folder)
    args.resume, args.log = False, "none"
    with tempfile.TemporaryDirectory(prefix="push-study-") as scratch, working(args):
        out = args.out or Path(scratch) / "again"
        run_study(study, out, args)
        same = (out / RUNS).read_bytes() == (args.folder / RUNS).read_bytes()
        found = [] if same else differences(before, read_runs(out))
    code = other_code(made)
    if not same:
        where = f" (made by other code: {'; '.join(code)})" if code else ""
        raise ReplayDiffers(f"{RUNS} differs: {'; '.join(found)}{where}", where=str(args.folder))
    tell(f"{len(before.rows)} pushes run again: {RUNS} is the same to the last byte")
    if code:
        tell(f"although {'; '.join(code)}")
    if args.json:
        say_json({"schema": 1, "runs": len(before.rows), "same": True, "other_code": code})
    return 0


def study_of(folder: Path) -> tuple[StudyFile, dict[str, Any]]:
    """Return the study of a folder, with the rig that was kept with it, and who made it. Raises UsageError."""
    try:
        text = (folder / STUDY).read_text(encoding="utf-8")
        made = json.loads((folder / MADE_BY).read_text(encoding="utf-8"))
        folders = tuple(map(str, made["law_folders"]))
    except (OSError, ValueError, KeyError, TypeError):
        raise UsageError(
            f"{STUDY} or {MADE_BY} is missing", where=str(folder), do="Give the folder of a finished `push study`"
        ) from None
    study = read_study(text, str(folder / STUDY), str(folder.resolve()))
    return study.with_rig(str((folder / RIG).resolve()), folders), made


def differences(before: Runs, now: Runs) -> list[str]:
    """Return what differs between two tables, the first few in words."""
    if before.columns != now.columns:
        return [f"the columns are {', '.join(now.columns)}, and were {', '.join(before.columns)}"]
    if len(before.rows) != len(now.rows):
        return [f"there are {len(now.rows)} runs, and were {len(before.rows)}"]
    found = [
        f"run {old['run']}: {key} is {new[key] or 'nothing'}, was {old[key] or 'nothing'}"
        for old, new in zip(before.rows, now.rows, strict=True)
        for key in before.columns
        if old[key] != new[key]
    ]
    more = len(found) - MOST_TOLD
    return [*found[:MOST_TOLD], *([f"and {more} more cells"] if more > 0 else [])] or ["other bytes in the same cells"]


def other_code(made: dict[str, Any]) -> list[str]:
    """Return in which facts today's code and machine differ from those that made a study."""
    then, now = made.get("facts", {}), code_and_machine()
    return [
        f"{name} is {now.get(name, 'unknown')}, was {then.get(name, 'unknown')}"
        for name in sorted({*then, *now})
        if then.get(name) != now.get(name)
    ]
