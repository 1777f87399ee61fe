"""`push run --trials N`: the battery of the command, from its folder to its table."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from robot_io.error_report import ignoring_output_errors, say_json, tell
from robot_io.errors import UsageError
from robot_io.rig.config import RigConfig
from tools.places import run_dir
from tools.places.trials_folder import TABLE, Trials
from tools.rig import devices_at, folder_of
from tools.run.facts.run_facts import level_of
from tools.trials.battery import run_trials, table
from tools.trials.question import REAL, SIMULATED, goes_on, has_terminal


def check_trials(args: argparse.Namespace, rig: RigConfig) -> None:
    """Raise UsageError where a battery cannot be run: into a folder that exists, or with nobody to reset the object."""
    if args.out is not None and args.out.exists():
        raise UsageError("this folder exists already", where=str(args.out), do="Give a new --out for the trials")
    if devices_at(rig, "hardware") and not has_terminal():
        raise UsageError(
            "--trials with real devices asks on a terminal before each trial, and stdin is none",
            where="push run",
            do="Somebody has to put the object back: start it in a terminal, or push once without --trials",
        )


def run_battery(
    args: argparse.Namespace, rig: RigConfig, push: Callable[[argparse.Namespace, Path], dict[str, Any]]
) -> int:
    """Run the trials, print their table and return the worst exit code; `push` runs and tells one."""
    real = bool(devices_at(rig, "hardware"))
    out = run_dir.create(args.out, rig.name)

    def one(folder: Path, seed: int, number: int) -> dict[str, Any]:
        if real and number > 1:
            from tools.doctor.before_run import look_before_run

            look_before_run(rig, folder_of(args.rig))
        return push(argparse.Namespace(**{**vars(args), "seed": seed}), folder)

    def ask(before: str) -> bool:
        return goes_on(f"{before}{REAL if real else SIMULATED}")

    begun = Trials(rig.name, level_of(rig), args.note, args.trials, 0)
    try:
        trials = run_trials(out, begun, args.seed, one, ask if has_terminal() else None)
    except BaseException:
        run_dir.discard(out)
        raise
    with ignoring_output_errors():
        for line in (*table(trials), f"table: {out / TABLE}; `push report {out}` draws the trials on one page"):
            tell(line) if args.json else print(line)
        if args.json:
            say_json({**msgspec.to_builtins(trials), "out": str(out)})
    return trials.exit_code
