"""The result of a run in words and numbers: `summary.json`, the `--json` object and the lines for people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robot_io.rig.config import RigConfig
from robot_io.tick import Mode
from safety.faults import FAULTS

VERDICTS = {
    0: "done",
    1: "error",
    2: "refused",
    4: "not ready",
    5: "safety stop",
    6: "contact lost",
    130: "operator stop",
}


def summary(
    rig: RigConfig,
    figures: dict[str, Any],
    *,
    out: Path,
    log: Path,
    seed: int,
    level: str,
    devices: dict[str, dict[str, int]],
    notes: list[str],
) -> dict[str, Any]:
    """Return the summary of a run (schema 1); `figures` is what control reported at its end."""
    code = figures["exit_code"]
    return {
        "schema": 1,
        "verdict": VERDICTS.get(code, "error"),
        "exit_code": code,
        "distance_m": figures["distance_m"],
        "lateral_error_m": figures["lateral_error_m"],
        "wanted_distance_m": rig.control.distance_m,
        "controller": rig.control.controller,
        "rig": rig.name,
        "level": level,
        "seed": seed,
        "out": str(out),
        "log": str(log),
        "phase": figures["phase"],
        "mode": figures["mode"],
        "faults": figures["faults"],
        "contact_seen": figures["contact_seen"],
        "residual_N": figures["residual_N"],
        "loop": figures["loop"],
        "safety_events": figures["events"],
        "fault_counts": figures["fault_counts"],
        "devices": devices,
        "notes": notes,
    }


def person_lines(summary: dict[str, Any]) -> list[str]:
    """Return the lines printed for people at the end of a run."""
    distance, lateral = summary["distance_m"], summary["lateral_error_m"]
    lines = []
    if summary["exit_code"] == 0:
        lines.append(f"pushed {distance:.2f} m, lateral error {lateral:+.3f} m")
    else:
        lines.append(
            f"{summary['verdict']} after {distance:.2f} m, lateral offset {lateral:+.3f} m: {stop_reason(summary)}"
        )
    loop = summary["loop"]
    if "late_p99_ms" in loop:
        lines.append(
            f"loop: {loop['measured_hz']:.2f} Hz, late p99 {loop['late_p99_ms']:.2f} ms "
            f"(worst {loop['late_worst_ms']:.2f} ms), "
            f"{loop['skipped']} of {loop['ticks'] + loop['skipped']} ticks skipped"
        )
    lines.append(f"safety events: {_counts(summary['fault_counts'])}")
    if summary["residual_N"] is not None:
        lines.append(f"sensor after the push: {summary['residual_N']:.2f} N from zero")
    lines += summary["notes"]
    lines.append(f"log: {summary['log']}")
    if summary.get("report"):
        lines.append(f"report: {summary['report']}")
    return lines


def stop_reason(summary: dict[str, Any]) -> str:
    """Return the faults that ended a run, in words; those that only followed from the stop are left out."""
    stopping = next((event for event in summary["safety_events"] if event["mode"] in ("STOP", "DEAD")), None)
    faults = stopping["faults"] if stopping else summary["faults"]
    reasons = [FAULTS[i].text for i in faults if i in FAULTS and FAULTS[i].mode >= Mode.HOLD]
    if not reasons and summary["verdict"] == "contact lost":
        return contact_loss_reason(summary["contact_seen"])
    return "; ".join(reasons) or summary["verdict"]


def contact_loss_reason(contact_seen: bool) -> str:
    """Return why a push failed without contact; an object too light to be felt may still have been there."""
    return "the force did not return" if contact_seen else "no contact was felt"


def _counts(counts: dict[str, int]) -> str:
    if not counts:
        return "none"
    return ", ".join(f"{i} ({FAULTS[i].text}) x{n}" if i in FAULTS else f"{i} x{n}" for i, n in counts.items())
