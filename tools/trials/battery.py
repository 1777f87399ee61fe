"""Run trials one after the other: what is asked between them, what ends the battery, and its table."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from robot_io.error_report import tell
from robot_io.errors import OperatorStop, PushError
from tools.places.trials_folder import NOT_STARTED, Trial, Trials, folder_name, write_trials
from tools.terminal.verdict import stop_reason

WORST_LAST = (0, 9, 6, 130, 5, 4, 3, 2, 1)
"""Exit codes: what a push came to, then the operator's and safety's stops, then what kept it from starting."""
MOST_SEEDS = 2**63

PushTrial = Callable[[Path, int, int], dict[str, Any]]
"""(folder, seed, number from 1) -> the run's summary. Raises PushError where it did not start."""
MayGoOn = Callable[[str], bool]
"""(what is said before the question) -> whether the next trial is to begin."""


def run_trials(folder: Path, trials: Trials, first_seed: int, push: PushTrial, may_go_on: MayGoOn | None) -> Trials:
    """Run the trials of a new battery; return it with their rows, written to its folder after each.

    may_go_on: asks the operator before each trial but the first; None where nobody can be asked: then a failed
    trial does not end the battery, but a stop by the operator does.
    Raises PushError where the first trial did not start, and nothing is left of it then.
    """
    for number in range(1, trials.wanted + 1):
        if number > 1 and may_go_on is not None and not may_go_on(_before(trials, number)):
            break
        name, seed = folder_name(number, trials.wanted), (first_seed + number - 1) % MOST_SEEDS
        tell(f"trial {number} of {trials.wanted}, seed {seed}")
        try:
            row = row_of(name, seed, push(folder / name, seed, number))
        except PushError as error:
            if number == 1:
                raise
            tell(f"push: {error}")
            row = Trial(name, seed, NOT_STARTED, error.exit_code, why=str(error))
        rows = (*trials.trials, row)
        trials = replace(trials, trials=rows, exit_code=worst(row.exit_code for row in rows))
        try:
            write_trials(folder, trials)
        except OSError as error:
            tell(f"the table of trials cannot be written: {error.strerror}")
        if may_go_on is None and row.exit_code == OperatorStop.exit_code:
            break
    return trials


def worst(codes: Iterable[int]) -> int:
    """Return the worst of some exit codes."""
    return max(codes, key=lambda code: WORST_LAST.index(code) if code in WORST_LAST else len(WORST_LAST))


def row_of(name: str, seed: int, summary: dict[str, Any]) -> Trial:
    """Return the row of a run that came to an end."""
    first = summary["first_fault"]
    return Trial(
        name,
        seed,
        summary["verdict"],
        summary["exit_code"],
        summary["distance_m"],
        summary["lateral_error_m"],
        summary["object_lateral_error_m"],
        summary["worst_force_N"],
        first["id"] if first else None,
        _why(summary),
    )


def table(trials: Trials) -> list[str]:
    """Return the table of a battery, line by line, and below it how many trials are done."""
    heads = ("trial", "verdict", "pushed", "end offset", "object", "worst force")
    rows = [
        (
            row.folder.removeprefix("trial-"),
            row.verdict,
            _number(row.distance_m, ".2f", "m"),
            _number(row.lateral_error_m, "+.3f", "m"),
            _number(row.object_lateral_error_m, "+.3f", "m"),
            _number(row.worst_force_N, ".1f", "N"),
        )
        for row in trials.trials
    ]
    widths = [max(len(cells[i]) for cells in (heads, *rows)) for i in range(len(heads))]
    lines = [
        "  ".join(
            cell.ljust(width) if i < 2 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
        )
        for cells in (heads, *rows)
    ]
    done = sum(row.exit_code == 0 for row in trials.trials)
    of = "" if len(trials.trials) == trials.wanted else f" ({trials.wanted} were wanted)"
    return [*lines, f"{done} of {len(trials.trials)} trials done{of}"]


def _before(trials: Trials, number: int) -> str:
    """Return what is said before the question: which trial is next, and how the one before failed, if it did."""
    last = trials.trials[-1]
    failed = f"{last.folder} ended in: {last.verdict}{f': {last.why}' if last.why else ''}. " if last.exit_code else ""
    return f"{failed}Trial {number} of {trials.wanted} is next. "


def _why(summary: dict[str, Any]) -> str:
    """Return what speaks against a run: the first cause of its stop, or the evidence."""
    if summary["exit_code"] == 0:
        return ""
    against = [item["text"] for item in summary["trust"] if item["says"] == "against"]
    reason = stop_reason(summary)
    return "; ".join(against) if reason == summary["verdict"] and against else reason


def _number(value: float | None, form: str, unit: str) -> str:
    return "-" if value is None else f"{value:{form}} {unit}"
