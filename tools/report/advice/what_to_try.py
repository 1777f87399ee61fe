"""What to try after a run, the most telling first: each line says why, and what to do."""

from __future__ import annotations

import math

from safety.table.fault_advice import advice_of
from sim_backend.physics.gain_limits import offset_per_degree_m, offset_per_newton_m
from tools.report.advice.force_angle import ForceAngle, force_angle, tare_error_newtons
from tools.report.run_data import RunData
from tools.report.run_verdict import Verdict
from tools.terminal.gain_warning import gain_warning
from tools.verdict.evidence import LINE

FRAME = "push calibrate frame"
BIAS = "push calibrate bias"
LONG_TARE_S = 5.0
"""A tare this long is no longer what limits a push."""
BY_EVIDENCE = {
    "contact_lost_m": "Contact was lost too long: start the push nearer to the middle of the object.",
    "contact_lost_times": "Contact was lost too often: lower `control.force_min_N` for a light object.",
    "early_contact": "Something was touched before the object: clear the way, or correct `path.expected_contact_m`.",
    "force_before_contact": f"The sensor did not read zero before contact: let it warm up, and tare again (`{BIAS}`).",
    "residual": "The sensor does not read zero after the push: look whether something pulls at its cable or tool, and "
    "tare for longer (`ft.tare_s`).",
    "log": "The log is not complete: `push log info` says what is missing.",
    "log_dropped": "Records are missing from the log: close other programs, and look whether the disk is slow or full.",
    "gate": "The gate failed: its last words are in processes.json beside the log.",
    "launcher": "The launcher fell silent: close other programs on this computer.",
}
"""What to try for a piece of evidence that speaks against a run; where the line itself is missed, numbers decide."""
NOTEWORTHY_M = 0.1
"""An end nearer to the path than this needs no explanation."""


def what_to_try(run: RunData, verdict: Verdict) -> list[str]:
    """Return what to try in sentences, most telling first; empty where nothing speaks against the run."""
    lines = []
    if verdict.first_fault:
        advice = advice_of(verdict.first_fault)
        lines += [f"{verdict.first_fault}: {advice.cause} {advice.next_step}".strip()] if advice.next_step else []
    against = [item.id for item in verdict.trust if item.says == "against"]
    if not verdict.first_fault:
        lines += [BY_EVIDENCE[name] for name in against if name in BY_EVIDENCE]
    lost = not verdict.good and run.rig.control.law == "open-loop"
    if lost:
        lines.append("This run steered without force feedback: `--law force` is the law of the paper.")
    missed = set(LINE) & set(against)
    if not verdict.first_fault and not lost:
        lines += _of_the_line(run, bool(missed))
    if not verdict.good and (warning := gain_warning(run.rig)):
        lines.append(f"{warning[0].upper()}{warning[1:]}.")
    return list(dict.fromkeys(lines))


def _of_the_line(run: RunData, missed: bool) -> list[str]:
    """Return what the end of the push says of sensor and tare, and what that costs beside the line."""
    control = run.rig.control
    if control.law != "force":
        return []  # the closed forms are those of the paper's law
    angle = force_angle(run)
    if angle is None or run.last is None:
        return ["Push further: this push was too short to settle on its line."] if missed else []
    end_m = run.last.after.control.end_lateral_m
    if not missed and not (abs(end_m) > NOTEWORTHY_M or angle.points_at_the_frame):
        return []
    per_degree = offset_per_degree_m(control.k_f, control.k_y_rad_per_m)
    per_newton = offset_per_newton_m(control.k_f, control.k_y_rad_per_m, angle.force_N)
    costs = (
        f"With gains {control.k_f:g}/{control.k_y_rad_per_m:g} and {angle.force_N:.1f} N, a degree of error in the "
        f"force's direction costs {per_degree:.2f} m beside the line, a newton of tare error {per_newton:.2f} m."
    )
    return [_next_step(run, angle, per_newton), costs]


def _next_step(run: RunData, angle: ForceAngle, per_newton_m: float) -> str:
    seen, start, tare = (math.degrees(a) for a in (angle.seen_rad, angle.transient_rad, angle.tare_rad))
    found = (
        f"Over the last {angle.over_m:.1f} m the force pointed {seen:+.1f} degrees aside, and the offset at the end "
        f"stands for {math.degrees(angle.offset_rad):+.1f}; what is left of the start explains at most {start:.1f}, "
        f"the tare {tare:.1f}"
    )
    if angle.points_at_the_frame:
        return f"{found}: the sensor's mounting is off, and `{FRAME}` measures it."
    if run.rig.ft.tare_s >= LONG_TARE_S or start > 2 * tare:
        return f"{found}: push further before anything is concluded from it."
    tare_N = tare_error_newtons(run.rig)
    return (
        f"{found}: tare for longer than {run.rig.ft.tare_s:g} s (`--set ft.tare_s=5`); its error of up to "
        f"{tare_N:.2f} N alone moves the line by {tare_N * per_newton_m:.2f} m."
    )
