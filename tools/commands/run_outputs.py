"""What `push run` leaves beside its log: the tare for the next run, summary and report. A failure is said, no more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robot_io.error_report import tell
from robot_io.errors import EnvironmentFault
from robot_io.rig.config import RigConfig
from tools.places import saved_tare
from tools.places.atomic_file import write_json
from tools.report.process import ReportProcess


def save_tare(rig: RigConfig, figures: dict[str, Any]) -> None:
    """Save the tare, if the run got that far, for `--start-in-contact`; print a message if that fails."""
    if figures["tared"]:
        bias = (*figures["bias_force_N"], *figures["bias_torque_Nm"])
        try:
            saved_tare.save(rig, bias, tuple(figures["held_joints_rad"]))
        except (OSError, EnvironmentFault) as error:
            tell(f"the tare was not saved: {error}")


def write_summary(summary: dict[str, Any], out: Path) -> None:
    """Write summary.json; print a message if that fails: the verdict is printed in any case."""
    try:
        write_json(out / "summary.json", summary)
    except OSError as error:
        tell(f"summary.json cannot be written: {error.strerror}")


def write_report(summary: dict[str, Any], out: Path, ready: ReportProcess | None) -> None:
    """Write report.html, with the process `ready` or a new one, and name it in `summary`."""
    try:
        making = ready or ReportProcess(Path(summary["log"]), out / "report.html")
        reason = making.make()
    except EnvironmentFault as fault:
        reason = str(fault)
    if reason:
        tell(f"no report: {reason}; `push report {out}` makes one from the log")
    else:
        summary["report"] = str(out / "report.html")


def with_injected(summary: dict[str, Any], counts: dict[str, int]) -> dict[str, Any]:
    """Return the summary and, if faults were injected, how many samples each has changed."""
    return summary | {"injected": counts} if counts else summary


def unused_faults(summary: dict[str, Any]) -> list[str]:
    """Return the faults to inject that changed nothing."""
    return [words for words, changed in summary.get("injected", {}).items() if changed == 0]
