"""The figures of a run whose control process could not report them, read from the log that the recorder finished."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from control.notes.run_notes import RunNotes, outcome
from robot_io.errors import LogDamaged
from robot_io.log.messages import GATE_SAYS, SAFETY_EVENT, SafetyEvent
from robot_io.mcap.read import read_log
from robot_io.tick import TICK_CDR, ControlTick, Mode


def figures_from_log(log: Path, rate_hz: float, exit_code: int) -> dict[str, Any]:
    """Return the figures of a run from its ticks and the gate's last events, as control reports them when it ends.

    Raises LogDamaged (or UsageError: no file) when the log cannot be read or holds no tick.
    """
    notes = RunNotes()
    last: ControlTick | None = None
    first_ns = ticks = skipped = 0
    of_gate: list[SafetyEvent] = []
    for message in read_log(log):
        if message.topic == "/control/tick":
            last = TICK_CDR.decode(message.payload)
            notes.note(last.input, last.after, last.output)
            first_ns = first_ns or last.input.now_ns
            ticks += 1
            skipped += last.input.host.skipped
        elif message.topic == "/safety/event":
            event = SAFETY_EVENT.decode(message.payload)
            if event.text.startswith(GATE_SAYS):
                of_gate.append(event)
    if last is None:
        raise LogDamaged("the log holds no tick", where=str(log), do="The run ended before its loop began")
    figures = outcome(last.input, last.after, last.output)
    faults = [event.fault for event in of_gate]
    ended_s = round((last.input.now_ns - first_ns) * 1e-9, 3)
    end = {"t_s": ended_s, "tick": last.input.tick, "mode": Mode.STOP.name, "faults": faults}
    if faults and not figures["first_fault"]:
        figures |= {"first_fault": faults[0], "first_value": None, "first_fault_s": ended_s}
    return {
        **figures,
        **notes.figures(),
        "exit_code": exit_code,
        "faults": faults,
        "loop": {"rate_hz": rate_hz, "ticks": ticks, "skipped": skipped},
        "events": [*notes.events, end] if faults else notes.events,
        "fault_counts": {**notes.fault_counts, **dict.fromkeys(faults, 1)},
        "ft": {"packets_ok": last.input.ft.packets_ok},
    }
