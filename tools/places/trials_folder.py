"""The folder of a battery of trials: a run folder for each, `trials.json` and `trials.csv` with a row for each."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import msgspec

from tools.places.atomic_file import write_atomically, write_json

TRIALS = "trials.json"
TABLE = "trials.csv"
NOT_STARTED = "not started"


class Trial(msgspec.Struct, frozen=True):
    """One trial; its numbers are None where they are not known. m, N; offsets from the path, left positive."""

    folder: str
    """Its name within the battery's folder."""
    seed: int
    verdict: str
    """As in summary.json, or NOT_STARTED."""
    exit_code: int
    distance_m: float | None = None
    lateral_error_m: float | None = None
    object_lateral_error_m: float | None = None
    worst_force_N: float | None = None
    first_fault: str | None = None
    why: str = ""
    """What speaks against it, in words; "" for one that is done."""


class Trials(msgspec.Struct, frozen=True):
    """A battery so far."""

    rig: str
    level: str
    note: str
    wanted: int
    exit_code: int
    """The worst of its trials."""
    trials: tuple[Trial, ...] = ()
    schema: int = 1


def folder_name(number: int, wanted: int) -> str:
    """Return the name of a trial's folder; they sort as they were run."""
    return f"trial-{number:0{max(2, len(str(wanted)))}d}"


def write_trials(folder: Path, trials: Trials) -> None:
    """Write `trials.json` and `trials.csv`. Raises OSError."""
    write_json(folder / TRIALS, msgspec.to_builtins(trials))
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(Trial.__struct_fields__)
    rows.writerows(msgspec.structs.astuple(trial) for trial in trials.trials)
    write_atomically(folder / TABLE, table.getvalue().encode())
