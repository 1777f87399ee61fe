"""Notes of a run for its summary: when faults appeared and cleared, how often each occurred, and how it ended."""

from __future__ import annotations

import math

from control.notes.push_course import PushCourse
from robot_io.tick import Mode, Phase, TickInput, TickOutput, TickState

MOST_EVENTS = 200


class RunNotes:
    """Records when the set of active faults changed, with the mode of that tick, and how often each fault occurred.

    At most MOST_EVENTS events are kept; counting continues beyond that.
    """

    def __init__(self) -> None:
        self.events: list[dict[str, object]] = []
        self.fault_counts: dict[str, int] = {}
        self.course = PushCourse()
        self.pauses = 0
        self.paused_ns = 0
        self._last: tuple[str, ...] = ()
        self._paused_since_ns = 0
        self._first_ns = 0

    def note(self, inp: TickInput, after: TickState, output: TickOutput) -> None:
        """Record one tick and the state after it."""
        x, y, _ = after.control.force_world
        self.course.note(after.control.phase, after.control.lateral_m, math.hypot(x, y))
        self._note_pause(inp)
        if not self._first_ns:
            self._first_ns = inp.now_ns
        for fault in output.faults:
            if fault not in self._last:
                self.fault_counts[fault] = self.fault_counts.get(fault, 0) + 1
        if output.faults != self._last and len(self.events) < MOST_EVENTS:
            self.events.append(
                {
                    "t_s": round((inp.now_ns - self._first_ns) * 1e-9, 3),
                    "tick": inp.tick,
                    "mode": Mode(output.mode).name,
                    "faults": list(output.faults),
                }
            )
        self._last = output.faults

    def figures(self) -> dict[str, object]:
        """Return the notes as part of a run's figures."""
        pauses = {"pauses": self.pauses, "paused_s": round(self.paused_ns * 1e-9, 2)}
        return {"events": self.events, "fault_counts": self.fault_counts, **pauses, **self.course.figures()}

    def _note_pause(self, inp: TickInput) -> None:
        """Count the operator's pauses and how long they were."""
        if not inp.paused:
            self._paused_since_ns = 0
            return
        if self._paused_since_ns:
            self.paused_ns += inp.now_ns - self._paused_since_ns
        else:
            self.pauses += 1
        self._paused_since_ns = inp.now_ns


def outcome(inp: TickInput, state: TickState, output: TickOutput) -> dict[str, object]:
    """Return the final figures of a run (m, N, s since its first tick)."""
    control, safety = state.control, state.safety
    ended = control.phase in (Phase.RETREAT, Phase.CHECK, Phase.DONE, Phase.FAILED)
    return {
        "exit_code": output.exit_code,
        "phase": Phase(control.phase).name,
        "mode": Mode(output.mode).name,
        "faults": list(output.faults),
        "distance_m": control.end_progress_m if ended else control.progress_m,
        "lateral_error_m": control.end_lateral_m if ended else control.lateral_m,
        "first_tick_ns": safety.first_ns,
        "first_fault": safety.first_fault,
        "first_value": safety.first_value if math.isfinite(safety.first_value) else None,
        "first_fault_s": (safety.first_fault_ns - safety.first_ns) * 1e-9 if safety.first_fault else None,
        "law_error": control.law_error,
        "latch_cause": inp.base.latch_cause,
        "log_dropped": inp.host.log_dropped,
        "contact_seen": control.contact_seen,
        "residual_N": control.residual_N if math.isfinite(control.residual_N) else None,
        "lost_m": control.lost_m,
        "lost_times": control.lost_count,
        "early_contact": control.early_contact,
        "force_before_contact_N": force_N if math.isfinite(force_N := control.force_before_contact_N) else None,
        "bias_force_N": list(control.bias_force),
        "bias_torque_Nm": list(control.bias_torque),
        "tared": control.tared,
        "held_joints_rad": list(control.held_joints),
        "arm_packets": inp.arm.packets,
        "joints_rad": [q if math.isfinite(q) else None for q in inp.arm.joints.position],
    }
