"""`push replay LOG`: check that today's program computes, bit for bit, what the log holds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from robot_io.error_report import printable, say_json, tell
from robot_io.errors import ReplayDiffers, UsageError
from robot_io.log.log_format import FORMAT_FACT
from tools.places.find_log import find_log
from tools.replay import what_if_report
from tools.replay.base_inputs import BaseInputsReplay
from tools.replay.derived import DerivedReplay
from tools.replay.difference import Difference
from tools.replay.fold import replay
from tools.replay.result import ReplayResult
from tools.replay.what_if import what_if
from tools.run.facts.code_facts import COMMIT_FACT, DIRTY_FACT
from tools.run.facts.run_facts import code_and_machine
from tools.terminal.arguments import named_path, number, whole_number

DIFFERS = ReplayDiffers.exit_code


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push replay`."""
    parser.add_argument("log", type=named_path, help="run.mcap, or a run's folder")
    parser.add_argument(
        "--what-if", action="append", default=[], metavar="KEY=VALUE", help="re-run the same inputs with other settings"
    )
    parser.add_argument(
        "--law", default="", metavar="MODULE:CLASS", help="the log's law, if it does not come with the program"
    )
    parser.add_argument(
        "--tolerance", type=number(0, 1e6), metavar="X", help="accept differences up to X (log from another machine)"
    )
    parser.add_argument("--ticks", action="store_true", help="the ticks alone: neither the world nor derived topics")
    parser.add_argument(
        "--jobs",
        type=whole_number(1, 1000),
        default=1,
        metavar="N",
        help="with --ticks: re-run them by so many processes; the result is the same (1)",
    )
    parser.add_argument("--json", action="store_true", help="the result as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Replay; return 0 if identical, 7 if different. Raises LogDamaged (8) for a log that cannot be trusted."""
    path = find_log(args.log)
    if args.what_if:
        return answer_what_if(path, args)
    result = replay(path, tolerance=args.tolerance, law=args.law, ticks_only=args.ticks, jobs=args.jobs)
    for line in lines(result):
        (tell if args.json else print)(printable(line))
    if args.json:
        say_json(as_json(result))
    return DIFFERS if result.different else 0


def lines(result: ReplayResult) -> Iterator[str]:
    """Yield the result for people."""
    yield f"replay: {result.identical} of {result.ticks} ticks identical"
    differences = [("tick ", result.first_difference)]
    if result.world is not None:
        yield f"world: {result.world.identical} of {result.world.states} states identical"
        differences.append(("world state ", result.world.first_difference))
    if result.derived is not None:
        yield f"derived: {result.derived.identical} of {result.derived.messages} messages identical"
        differences.append(("message at ", result.derived.first_difference))
    if result.arrived is not None:
        yield f"arrived: {result.arrived.identical} of {result.arrived.messages} messages as the ticks hold them"
        differences.append(("message at ", result.arrived.first_difference))
    if result.gaps:
        yield f"gaps: {result.gaps} (ticks missing in the log; the state after each gap was read from the log)"
    for note in result.notes:
        yield f"note: {note}"
    if result.made_by.note and not result.different:
        yield f"note: {result.made_by.note}"
    for name, found in differences:
        if found is not None:
            values = f"logged {found.logged!r}, now {found.replayed!r}"
            yield f"first difference: {name}{found.tick}, {found.field}: {values}"
    if result.different:
        if result.made_by.cause:
            yield result.made_by.cause
        yield from machine_differences(result.facts)


def as_json(result: ReplayResult) -> dict[str, Any]:
    """Return the result as the `--json` object."""
    world = result.world
    return {
        "schema": 1,
        "ticks": result.ticks,
        "identical": result.identical,
        "gaps": result.gaps,
        "first_difference": _plain(result.first_difference),
        "world": None
        if world is None
        else {
            "states": world.states,
            "identical": world.identical,
            "first_difference": _plain(world.first_difference),
        },
        "derived": _messages(result.derived),
        "arrived": _messages(result.arrived),
        "complete": result.complete,
        "made_by": {
            "format": result.made_by.format,
            "commit": result.made_by.commit,
            "dirty": result.made_by.dirty,
            "other": result.made_by.other,
        },
        "notes": list(result.notes),
        "machine_differences": machine_differences(result.facts),
    }


def _messages(found: DerivedReplay | BaseInputsReplay | None) -> dict[str, Any] | None:
    if found is None:
        return None
    first = _plain(found.first_difference)
    return {"messages": found.messages, "identical": found.identical, "first_difference": first}


def machine_differences(facts: dict[str, str]) -> list[str]:
    """Return what else differs between the log and now, in words: versions, machine."""
    reported = (FORMAT_FACT, COMMIT_FACT, DIRTY_FACT)
    now = {name: value for name, value in code_and_machine().items() if name in facts and name not in reported}
    return [f"{name} was {facts[name]}, is {value}" for name, value in now.items() if facts[name] != value]


def answer_what_if(path: Path, args: argparse.Namespace) -> int:
    """Re-run the log's inputs with other settings and say what would differ. Raises UsageError with --tolerance."""
    if args.tolerance is not None:
        what = "--tolerance is for comparing with the log, which --what-if does not do"
        raise UsageError(what, where="push replay", do="Leave one of them out")
    result = what_if(path, args.what_if, law=args.law)
    for line in what_if_report.lines(result):
        (tell if args.json else print)(printable(line))
    if args.json:
        say_json(what_if_report.as_json(result))
    return 0


def _plain(found: Difference | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "tick": found.tick,
        "field": found.field,
        "logged": _number(found.logged),
        "replayed": _number(found.replayed),
    }


def _number(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value if isinstance(value, str | int | float | bool | list) or value is None else repr(value)
