"""The figures that control left at its end, or its log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robot_io.errors import OperatorStop, PushError, SafetyStop
from robot_io.ipc.spawn import Child
from tools.run.facts.figures_from_log import figures_from_log


def final_figures(
    control: Child, log: Path, rate_hz: float, *, killed_by_operator: bool
) -> tuple[dict[str, Any], list[str]]:
    """Return control's figures, or those from the log if control could not report them, and notes on that.

    Raises control's own error, or SafetyStop where nothing is left to read.
    """
    if control.finished is not None:
        figures: dict[str, Any] = control.finished
        if not figures["error"]:
            return figures, []
        return figures, [f"{figures['error']}; this is a bug, its traceback is in {control.save_stderr()}"]
    if control.errors:
        raise control.errors[-1]
    if killed_by_operator:
        code, how = OperatorStop.exit_code, "was killed by the operator"
    elif control.process.returncode < 0:
        code, how = SafetyStop.exit_code, control.how_it_ended()
    else:
        code, how = control.process.returncode, f"{control.how_it_ended()}, see {control.save_stderr()}"
    stopped = f"the control process {how}; the gate stopped the base"
    try:
        figures = figures_from_log(log, rate_hz, code)
    except PushError as unreadable:
        raise SafetyStop(stopped, where="control", do=f"Its log does not say more ({unreadable.what})") from None
    return figures, [stopped]
