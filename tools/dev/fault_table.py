"""Write the fault table for the docs from `safety/faults.py`.

python -m tools.dev.fault_table                           # the table in docs/safety.md
python -m tools.dev.fault_table --page > docs/faults.md   # the page: an entry for each row
"""

from __future__ import annotations

import sys

from robot_io.rig.fault_words import KINDS
from robot_io.tick import Mode
from safety.faults import FAULTS, Clears, Fault, limit_of
from safety.settings import SafetySettings
from tools.rig import resolve_rig

INTRO = """# Faults

What can stop or slow a push, row by row: what is measured and its limit, the reaction, how soon it must come, how the
row clears, its likely causes and what to do next. `push faults` prints the table, and [safety](safety.md) says how the
reactions work. Limits are those of the rig `emulated`; a bound counts ticks of 10 ms, from the first tick in which
the fault can be seen to the first reduced command.

`push faults --run` brings every row about and measures the reaction; `--only F01` does so for one row or family.
Each row is brought about at level sim, exact to the tick; those that a device alone can cause also at level emulated,
with real drivers and processes: there the command that has arrived at the base counts (from the gate, where it is the
base that does not obey), and may be two ticks later. A round in which this machine kept a process waiting and which
failed is repeated, three times at most.
With `--json`, `measured_ticks` is null where no command is to be reduced, and `pass` then says that the row did what
it should. Beyond the rows of the table these are proved:

| id | what | passes if |
|---|---|---|
| F13 | the force is 50 ms late, its times are not | the push ends on the line, without a fault |
| F62 | the wall clock jumps by an hour, again and again | not one byte of the log differs |
| F71 | an hour of pushes on the virtual clock | no descriptor more is open, and at most 2 MB are kept |
| F72 | two devices lost, or one and something of the host | the stronger reaction comes within the longer bound |

## Faults on demand

    push run sim --fast --fault "ft.frozen at 10 s for 1 s"
    push run emulated --fault "base.pose.turned=5 at 0 s" --fault "arm.off at 12 s"

`--fault "DEVICE.KIND[=VALUE] at T s [for T s]"` changes what a device gives, or what the base obeys, at the driver's
edge, before control and gate see it; T counts from the first tick. In a rig file the same words are a list:
`[faults]`, `inject = ["ft.off at 10 s"]`. It works at the levels sim and emulated, and is refused where any device is
real. The log notes each fault, and replays like any other; `summary.json` counts under `injected` how many samples each
fault has changed. A fault that changed nothing is an error (exit code 2).
"""


def table() -> str:
    """Return the table as Markdown."""
    lines = ["| id | what | reaction | clears | bound (ticks) | exit |", "|---|---|---|---|---|---|"]
    for fault in FAULTS.values():
        code = str(fault.exit_code) if fault.mode >= Mode.HOLD else ""
        lines.append(
            f"| {fault.id} | {fault.text} | {_reaction(fault)} | {_clears(fault)} | {fault.bound_ticks} | {code} |"
        )
    return "\n".join(lines) + "\n"


def page() -> str:
    """Return docs/faults.md."""
    settings = SafetySettings.of(resolve_rig("emulated"))
    return INTRO + _kinds() + "\n## The rows\n" + "".join(_entry(fault, settings) for fault in FAULTS.values())


def _kinds() -> str:
    lines = ["", "| kind | what it does | without a value |", "|---|---|---|"]
    for device, kinds in KINDS.items():
        for name, kind in kinds.items():
            default = ",".join("" if number != number else f"{number:g}" for number in kind.default)
            lines.append(f"| {device}.{name} | {kind.text} | {default} |")
    return "\n".join(lines) + "\n"


def _entry(fault: Fault, settings: SafetySettings) -> str:
    limit = limit_of(fault, settings)
    measured = f"{fault.measured}, {fault.unit}" if fault.unit else fault.measured
    ticks = "tick" if fault.bound_ticks == 1 else "ticks"
    facts = [
        ("Measured", measured),
        ("Limit", "" if limit is None else f"{limit:g} {fault.unit}".strip()),
        ("Reaction", f"{_reaction(fault)}, clears {_clears(fault)}"),
        ("Bound", f"{fault.bound_ticks} {ticks}" if fault.mode > Mode.SILENT else ""),
        ("Exit code", str(fault.exit_code) if fault.mode >= Mode.HOLD else ""),
        ("Likely causes", fault.cause),
        ("Next step", fault.next_step),
    ]
    lines = [f"\n### {fault.id}", "", f"{fault.text[0].upper()}{fault.text[1:]}.", ""]
    return "\n".join([*lines, *(f"- {name}: {text}" for name, text in facts if text)]) + "\n"


def _reaction(fault: Fault) -> str:
    return fault.mode.name if fault.mode > Mode.SILENT else "logged"


def _clears(fault: Fault) -> str:
    return "by itself" if fault.clears == Clears.AUTO else "with a new run"


if __name__ == "__main__":
    sys.stdout.write(page() if "--page" in sys.argv[1:] else table())
