"""Write the fault table for docs/safety.md from `safety/faults.py`: `python -m tools.dev.fault_table`."""

from __future__ import annotations

import sys

from robot_io.tick import Mode
from safety.faults import FAULTS, Clears


def table() -> str:
    """Return the table as Markdown."""
    lines = ["| id | what | reaction | clears | bound (ticks) | exit |", "|---|---|---|---|---|---|"]
    for fault in FAULTS.values():
        reaction = fault.mode.name if fault.mode > Mode.SILENT else "logged"
        clears = "by itself" if fault.clears == Clears.AUTO else "with a new run"
        code = str(fault.exit_code) if fault.mode >= Mode.HOLD else ""
        lines.append(f"| {fault.id} | {fault.text} | {reaction} | {clears} | {fault.bound_ticks} | {code} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(table())
