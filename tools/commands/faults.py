"""`push faults`: the fault table; with `--run` every row is brought about and its reaction measured."""

from __future__ import annotations

import argparse
from typing import Any

from robot_io.error_report import ignoring_output_errors, say_json, tell
from robot_io.errors import UsageError
from robot_io.tick import Mode
from safety.faults import FAULTS, Clears, Fault, limit_of
from safety.settings import SafetySettings
from tools.rig import resolve_rig

FAILED = 1
RIG = "emulated"
"""Whose settings the limits of the table are."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push faults`."""
    parser.add_argument("--run", action="store_true", help="bring each row about and measure the reaction")
    parser.add_argument("--only", metavar="ID", help="one row, or a family: F37 means F37, F37-slow, ...")
    parser.add_argument("--json", action="store_true", help="one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Print the table, or prove it; return 1 if a row did not keep its promise."""
    ids = chosen(args.only)
    if not args.run:
        rows = [described(FAULTS[i]) for i in ids if i in FAULTS]
        if not rows:
            raise UsageError(f"`{args.only}` is no row of the table", where="--only", do="Use --run with it")
        say_json({"schema": 1, "rows": rows}) if args.json else print(plain(rows))
        return 0
    from tools.faults.judgement import Proof
    from tools.faults.proof import prove

    proof: list[Proof] = []
    with ignoring_output_errors():
        for one in prove(ids):
            proof.append(one)
            (tell if args.json else print)(line_of(one))
        if args.json:
            say_json({"schema": 1, "rows": [as_json(one) for one in proof]})
    return 0 if proof and all(one.passed for one in proof) else FAILED


def chosen(only: str | None) -> list[str]:
    """Return the ids of the rows, or of a family. Raises UsageError if there is none."""
    from tools.faults.proof import ALL_IDS

    if only is None:
        return list(ALL_IDS)
    found = [i for i in ALL_IDS if i == only or i.startswith(f"{only}-")]
    if not found:
        raise UsageError(f"there is no row `{only}`", where="--only", do="`push faults` lists them")
    return found


def described(fault: Fault) -> dict[str, Any]:
    """Return a row as JSON."""
    return {
        "id": fault.id,
        "text": fault.text,
        "measured": fault.measured,
        "limit": limit_of(fault, SafetySettings.of(resolve_rig(RIG))),
        "unit": fault.unit,
        "reaction": reaction(fault),
        "clears": "by itself" if fault.clears == Clears.AUTO else "with a new run",
        "bound_ticks": fault.bound_ticks,
        "exit_code": fault.exit_code if fault.mode >= Mode.HOLD else None,
        "cause": fault.cause,
        "next_step": fault.next_step,
    }


def reaction(fault: Fault) -> str:
    """Return the reaction in a word."""
    return fault.mode.name if fault.mode > Mode.SILENT else "logged"


def plain(rows: list[dict[str, Any]]) -> str:
    """Return the table for a terminal."""
    lines = [f"{'id':<10} {'reaction':<8} {'ticks':>5} {'exit':>4}  what"]
    for row in rows:
        limit = "" if row["limit"] is None else f" (limit {row['limit']:g} {row['unit']})".replace(" )", ")")
        code = "" if row["exit_code"] is None else row["exit_code"]
        lines.append(f"{row['id']:<10} {row['reaction']:<8} {row['bound_ticks']:>5} {code:>4}  {row['text']}{limit}")
    return "\n".join(lines)


def as_json(one: Any) -> dict[str, Any]:
    """Return a proved row as JSON."""
    return {
        "id": one.id,
        "what": one.what,
        "level": one.level,
        "measured_ticks": one.measured_ticks,
        "bound_ticks": one.bound_ticks,
        "pass": one.passed,
        "why": one.why,
        "repeats": one.repeats,
    }


def line_of(one: Any) -> str:
    """Return a proved row for a terminal."""
    measured = "    -" if one.measured_ticks is None else f"{one.measured_ticks:>5}"
    verdict = "pass" if one.passed else f"FAIL: {one.why}"
    again = f" ({one.repeats} repeated)" if one.repeats else ""
    return f"{one.id:<10} {one.level:<9} {measured} of {one.bound_ticks:>3} ticks  {verdict}{again}  ({one.what})"
