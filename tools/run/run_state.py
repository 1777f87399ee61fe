"""The initial state of a run, and the figures of its live line."""

from __future__ import annotations

import math

from control.sequence import FRESH_NS
from robot_io.tick import ControlState, Mode, Phase, TickInput, TickOutput, TickState
from tools.places.saved_tare import SavedTare


def initial_state(saved: SavedTare | None) -> TickState:
    """Return the state a run starts with: untared, or with a saved tare, valid at the joint positions saved with it."""
    if saved is None:
        return TickState()
    bias = saved.bias
    return TickState(ControlState(tared=True, bias_force=bias[:3], bias_torque=bias[3:], held_joints=saved.joints))


def status_line(inp: TickInput, state: TickState, output: TickOutput) -> dict[str, object]:
    """Return the figures of the live line; the speed (m/s) is that of the command after the envelope."""
    control = state.control
    return {
        "tick": inp.tick,
        "phase": Phase(control.phase).name,
        "mode": Mode(output.mode).name,
        "paused": inp.paused,
        "old": _old(inp, state),
        "progress_m": round(control.progress_m, 4),
        "lateral_m": round(control.lateral_m, 4),
        "force_N": [round(value, 2) for value in control.force_world],
        "theta_p": round(control.theta_p, 4),
        "speed": round(math.hypot(output.command_body.vx, output.command_body.vy), 4),
        "faults": list(output.faults),
        "fault_values": list(output.fault_values),
        "first_fault": state.safety.first_fault,
        "first_value": state.safety.first_value,
        "late_ms": round(inp.host.late_ns * 1e-6, 3),
    }


def _old(inp: TickInput, state: TickState) -> list[str]:
    """Return which of force and pose are too old to stand for the present."""
    force = state.control.tared and not state.control.force_valid
    pose = inp.base.pose_seq > 0 and inp.now_ns - inp.base.pose_received_ns > FRESH_NS
    return [name for name, old in (("force", force), ("pose", pose)) if old]
