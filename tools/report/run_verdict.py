"""The verdict of a run for its report: from the log, and from the summary beside it where there is one."""

from __future__ import annotations

from typing import Any, NamedTuple

import msgspec

from control.notes.push_course import PushCourse
from control.notes.run_notes import outcome
from robot_io.clock import NS_PER_S
from robot_io.tick import ControlTick, Mode
from safety.faults import FAULTS
from tools.report.run_data import RunData
from tools.terminal.verdict import cause_words, contact_loss_reason
from tools.verdict.evidence import TrustItem, gather
from tools.verdict.first_cause import fault_words, first_fault, with_dead_emulators
from tools.verdict.judgement import CONTACT_LOST, judge
from tools.verdict.witness import Witness

WORLD_SILENT_S = 0.15
"""An emulated world that says nothing for so long before the last tick has ended: 15 states of it are missing."""


class Verdict(NamedTuple):
    """How the run ended: one line, the reason, whether it is done, and the evidence for and against it.

    first_fault: the row of the fault table that stopped it, "" where none did. word: the verdict in a word or two.
    """

    line: str
    why: str
    good: bool
    trust: tuple[TrustItem, ...] = ()
    first_fault: str = ""
    word: str = "did not start"


def verdict(run: RunData, summary: dict[str, Any]) -> Verdict:
    """Return the verdict of a run. `summary` knows what no log can tell: how the other processes ended."""
    if run.last is None:
        return Verdict(
            "Did not start", "The loop did not start: the devices were not ready, or it was stopped first.", False
        )
    end = _figures(run, run.last)
    trust = _told(summary) or tuple(gather(run.rig, end, _witness(run), _ended_s(run, run.last)))
    distance, lateral = f"{end['distance_m']:.2f} m", f"{end['lateral_error_m']:+.3f} m"
    first = first_fault(run.rig, with_dead_emulators(end | {"first_tick_ns": 0}, _emulators_died_ns(run)))
    why = cause_words(first, end["faults"]) if first else _without_first(end["faults"])
    if not run.last.output.finished:
        phase = str(end["phase"]).lower().replace("_", " ")
        return Verdict(
            f"Aborted after {distance}",
            f"The log ends during the run (phase {phase}){': ' + why if why else ''}.",
            False,
            trust,
            first.id if first else "",
            "aborted",
        )
    judged = judge(end["exit_code"], trust)
    if end["exit_code"] == 0:
        against = "; ".join(item.text for item in trust if item.says == "against")
        line = f"Pushed {distance}" + (f", {judged.verdict}" if against else "")
        why = f"Lateral error at the end: {lateral}." + (f" Against the run: {against}." if against else "")
        return Verdict(line, why, not judged.exit_code, trust, word=judged.verdict)
    if not why and judged.verdict == CONTACT_LOST:
        why = contact_loss_reason(end["contact_seen"]).capitalize()
    why = f"{why or 'See the safety events'}. Lateral offset at the end: {lateral}."
    line = f"{judged.verdict.capitalize()} after {distance}"
    return Verdict(line, why, False, trust, first.id if first else "", judged.verdict)


def _without_first(faults: list[str]) -> str:
    """Return the faults that stopped a run in words: logs of earlier versions do not tell which came first."""
    return "; ".join(fault_words(i, None, None, "") for i in faults if i in FAULTS and FAULTS[i].mode >= Mode.HOLD)


def trust_rows(trust: tuple[TrustItem, ...]) -> list[tuple[str, str, str]]:
    """Return (name, what it says of the run, in words) for each piece of evidence, those against it first."""
    order = {"against": 0, "unknown": 1, "for": 2}
    return [(i.id.replace("_", " "), i.says, i.text) for i in sorted(trust, key=lambda i: order[i.says])]


def _emulators_died_ns(run: RunData) -> int:
    """Return when the emulators ended (ns since the first tick), as far as a log shows it: 0 if they lived on.

    Their world is logged 100 times a second until the loop has ended.
    """
    if run.world_end_s is None or run.first is None or run.last is None:
        return 0
    end_s = (run.last.input.now_ns - run.first.input.now_ns) / NS_PER_S
    return round(run.world_end_s * NS_PER_S) if end_s - run.world_end_s > WORLD_SILENT_S else 0


def _figures(run: RunData, last: ControlTick) -> dict[str, Any]:
    """Return the figures of the run as control reports them, its course from the kept ticks."""
    course, ticks = PushCourse(), run.ticks
    for phase, lateral_m in zip(ticks["phase"], ticks["lateral_m"], strict=True):
        course.note(int(phase), float(lateral_m))
    counts = {"fault_counts": {span.name: 1 for span in run.faults}}
    return {**outcome(last.input, last.after, last.output), **course.figures(), **counts}


def _witness(run: RunData) -> Witness:
    counted = [value for key, value in run.facts.items() if key.startswith("dropped_") or key == "undecodable"]
    missing = sum(int(value) for value in counted if value.isdecimal())
    return Witness(f"recovered, {run.recovered}" if run.recovered else "", missing)


def _ended_s(run: RunData, last: ControlTick) -> float | None:
    """Return when a run ended (s since the epoch), None where its log does not tell."""
    offset = run.facts.get("wall_offset_ns", "")
    return (last.input.now_ns + int(offset)) / NS_PER_S if offset.lstrip("-").isdecimal() else None


def _told(summary: dict[str, Any]) -> tuple[TrustItem, ...]:
    """Return the evidence in a summary, () if there is none that can be used."""
    try:
        return msgspec.convert(summary.get("trust", ()), tuple[TrustItem, ...])
    except msgspec.ValidationError:
        return ()
