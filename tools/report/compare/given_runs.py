"""The runs that are compared: logs, runs' folders and folders of trials, each run once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robot_io.errors import UsageError
from robot_io.mcap.files import has_parts
from tools.places.find_log import find_log
from tools.places.run_dir import LOG
from tools.report.compare.labels import labels
from tools.report.page import read_summary_file, run_mark
from tools.report.run_data import RunData, read_run
from tools.report.run_facts import note_of
from tools.report.run_verdict import Verdict, verdict

MOST_RUNS = 100
TRIALS = "trial-*"


class ComparedRun:
    """A run beside others: its log's data, its number, what tells it from the others, its verdict and its note."""

    def __init__(self, run: RunData, number: int, label: str) -> None:
        self.run = run
        self.number = number
        self.label = label
        summary = read_summary_file(run.log.with_name("summary.json"))
        self.verdict: Verdict = verdict(run, summary)
        self.note = note_of(run, summary)


def logs_of(named: Sequence[Path]) -> list[Path]:
    """Return the logs of what a user names, a folder of trials standing for all of its runs.

    Raises UsageError for a folder without a run, and where there are too many.
    """
    logs: list[Path] = []
    for path in named:
        logs += _trials(path) or [find_log(path)]
    if len(logs) > MOST_RUNS:
        raise UsageError(f"{len(logs)} runs are too many for one page", do=f"Give at most {MOST_RUNS}")
    return logs


def read_runs(logs: Sequence[Path]) -> list[ComparedRun]:
    """Read runs for one page. Raises LogDamaged for a log that cannot be trusted, UsageError for a run given twice."""
    runs: list[RunData] = []
    first: dict[str, Path] = {}
    for log in logs:
        run = read_run(log)
        mark = _mark(run)
        if mark in first:
            raise UsageError(f"this is the same run as {first[mark]}", where=str(log), do="Give each run once")
        first[mark] = log
        runs.append(run)
    names = zip(runs, labels(runs), strict=True)
    return [ComparedRun(run, number, label) for number, (run, label) in enumerate(names, 1)]


def path_notes(runs: Sequence[ComparedRun]) -> list[str]:
    """Return in words what has to be known before these runs are compared."""
    notes = []
    rigs = [one.run.rig for one in runs]
    if len({rig.path for rig in rigs}) > 1:
        notes.append("These runs were pushed along different paths; each is drawn in the frame of its own path.")
    lengths = sorted({rig.control.distance_m for rig in rigs})
    if len(lengths) > 1:
        notes.append(f"The distance that was asked for differs: {', '.join(f'{m:g}' for m in lengths)} m.")
    recovered = [str(one.number) for one in runs if one.run.recovered]
    if recovered:
        notes.append(f"Recovered logs, whose end is missing: {', '.join(recovered)}.")
    unseen = [str(one.number) for one in runs if not one.run.slider_source]
    if unseen:
        notes.append(f"The object was not seen in {', '.join(unseen)}: the contact point is drawn instead.")
    return notes


def _trials(folder: Path) -> list[Path]:
    """Return the logs of a folder of trials; empty for anything else, also for what cannot be read."""
    try:
        if (folder / LOG).exists() or has_parts(folder / LOG):
            return []
        return sorted(trial / LOG for trial in folder.glob(TRIALS) if (trial / LOG).exists() or has_parts(trial / LOG))
    except OSError:
        return []


def _mark(run: RunData) -> str:
    """Return what is the same only for the same run: settings, facts and the first and last moments."""
    begin = run.first.input.now_ns if run.first else 0
    end = run.last.input.now_ns if run.last else 0
    return f"{run_mark(run)} {begin} {end} {run.messages} {run.facts.get('message_sum', '')}"
