"""The result of a run in words and numbers: `summary.json`, the `--json` object and the lines for people."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import msgspec

from robot_io.rig.config import RigConfig
from safety.faults import FAULTS
from tools.verdict.evidence import gather
from tools.verdict.first_cause import FirstFault, fault_words, first_fault, stronger_than
from tools.verdict.judgement import CONTACT_LOST, DONE, NOT_TRUSTED, OFF_THE_LINE, judge
from tools.verdict.object_pose import ObjectPose
from tools.verdict.witness import Witness


def summary(
    rig: RigConfig,
    figures: dict[str, Any],
    *,
    out: Path,
    log: Path,
    seed: int,
    level: str,
    note: str,
    devices: dict[str, dict[str, int]],
    notes: list[str],
    witness: Witness,
    pushed: ObjectPose | None,
) -> dict[str, Any]:
    """Return the summary of a run (schema 1).

    figures: what control reported at its end. note: the operator's. witness: what else is known of the run. pushed:
    where the object is, as far as that is known.
    """
    trust = gather(rig, figures, witness, time.time())
    judged = judge(figures["exit_code"], trust)
    return {
        "schema": 1,
        "verdict": judged.verdict,
        "exit_code": judged.exit_code,
        "first_fault": msgspec.to_builtins(first_fault(rig, figures)),
        "trust": msgspec.to_builtins(trust),
        "distance_m": figures["distance_m"],
        "lateral_error_m": figures["lateral_error_m"],
        "object_lateral_error_m": pushed.lateral_m if pushed else None,
        "object_turned_rad": pushed.turned_rad if pushed else None,
        "wanted_distance_m": rig.control.distance_m,
        "law": rig.control.law,
        "rig": rig.name,
        "level": level,
        "seed": seed,
        "note": note,
        "out": str(out),
        "log": str(log),
        "phase": figures["phase"],
        "mode": figures["mode"],
        "faults": figures["faults"],
        "contact_seen": figures["contact_seen"],
        "residual_N": figures["residual_N"],
        "worst_force_N": figures["worst_force_N"],
        "pauses": figures["pauses"],
        "paused_s": figures["paused_s"],
        "loop": figures["loop"],
        "safety_events": figures["events"],
        "fault_counts": figures["fault_counts"],
        "devices": devices,
        "notes": [*([f"the law: {figures['law_error']}"] if figures.get("law_error") else []), *notes],
    }


def person_lines(summary: dict[str, Any]) -> list[str]:
    """Return the lines printed for people at the end of a run: the verdict, and what is known of it."""
    verdict, where, distance_m = summary["verdict"], _where(summary), summary["distance_m"]
    if verdict in (DONE, OFF_THE_LINE, NOT_TRUSTED):
        against = "; ".join(_told(summary, "against"))
        but = f", but {verdict}: {against}" if against else ""
        lines = [f"pushed {distance_m:.2f} m, lateral error {where}{but}"]
        lines += [f"not known: {text}" for text in _told(summary, "unknown")]
    else:
        lines = [f"{verdict} after {distance_m:.2f} m, lateral offset {where}: {stop_reason(summary)}"]
    loop = summary["loop"]
    if "late_p99_ms" in loop:
        lines.append(
            f"loop: {loop['measured_hz']:.2f} Hz, late p99 {loop['late_p99_ms']:.2f} ms "
            f"(worst {loop['late_worst_ms']:.2f} ms), "
            f"{loop['skipped']} of {loop['ticks'] + loop['skipped']} ticks skipped"
        )
    if summary["pauses"]:
        times = "once" if summary["pauses"] == 1 else f"{summary['pauses']} times"
        lines.append(f"paused {times}, {summary['paused_s']:.0f} s in all")
    lines.append(f"safety events: {_counts(summary['fault_counts'])}")
    if summary["residual_N"] is not None:
        lines.append(f"sensor after the push: {summary['residual_N']:.2f} N from zero")
    lines += summary["notes"]
    lines.append(f"log: {summary['log']}")
    return lines


def _told(summary: dict[str, Any], says: str) -> list[str]:
    """Return the evidence that speaks for or against a run, or is unknown, in words."""
    return [item["text"] for item in summary["trust"] if item["says"] == says]


def _where(summary: dict[str, Any]) -> str:
    """Return the pusher's lateral offset and, where it is known, the object's."""
    pusher = f"{summary['lateral_error_m']:+.3f} m"
    if summary["object_lateral_error_m"] is None:
        return pusher
    turned = round(math.degrees(summary["object_turned_rad"]), 0) + 0.0  # no -0
    return f"{pusher} (the object: {summary['object_lateral_error_m']:+.3f} m, turned {turned:+.0f} degrees)"


def stop_reason(summary: dict[str, Any]) -> str:
    """Return the first cause of a stop in words, and what asked for more after it; consequences are left out."""
    if summary["first_fault"] is None:
        if summary["verdict"] == CONTACT_LOST:
            return contact_loss_reason(summary["contact_seen"])
        return str(summary["verdict"])
    first = FirstFault(**summary["first_fault"])
    return cause_words(first, summary["faults"])


def cause_words(first: FirstFault, faults: list[str]) -> str:
    """Return the first cause in words, and those of the run's last `faults` that asked for more than it did."""
    later = [fault_words(fault, None, None, "") for fault in stronger_than(first.id, faults)]
    return "; then ".join([first.words(), *later])


def contact_loss_reason(contact_seen: bool) -> str:
    """Return why a push failed without contact; an object too light to be felt may still have been there."""
    return "the force did not return" if contact_seen else "no contact was felt"


def _counts(counts: dict[str, int]) -> str:
    if not counts:
        return "none"
    return ", ".join(f"{i} ({FAULTS[i].text}) x{n}" if i in FAULTS else f"{i} x{n}" for i, n in counts.items())
