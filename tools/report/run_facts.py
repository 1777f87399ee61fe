"""What was run, by whom and with what: first what a reader asks for, then what a machine compares."""

from __future__ import annotations

import datetime
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.rig.config import RigConfig
from tools.laws import law_label
from tools.report.run_data import RunData


def level_words(run: RunData) -> str:
    """Return the rig's name and, where the name does not say it, the level."""
    level = run.facts.get("level", "unknown level")
    return run.rig.name if run.rig.name == level else f"{run.rig.name} ({level})"


def note_of(run: RunData, summary: dict[str, Any]) -> str:
    """Return the operator's note on a run, "" if there is none."""
    return str(summary.get("note") or run.facts.get("note", ""))


def reader_facts(run: RunData, summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return (what, value) in the order in which a reader asks."""
    control, facts = run.rig.control, run.facts
    gains = "" if control.law == "open-loop" else f", k_f {control.k_f:g}, k_y {control.k_y_rad_per_m:g} rad/m"
    changed = ", with uncommitted changes" if facts.get("dirty") == "True" else ""
    rows = [
        ("when", _when(run)),
        ("note", note_of(run, summary)),
        ("rig", level_words(run)),
        ("law", f"{law_label(run.rig)}{gains}"),
        ("push", f"{control.distance_m:g} m at {control.push_speed_m_per_s:g} m/s"),
        ("object", object_words(run.rig)),
        ("seed", facts.get("seed", "")),
        ("log", f"{run.log.name}, {run.duration_s:.1f} s, {run.messages} messages"),
        ("program", f"{facts.get('program', 'unknown')}, commit {facts.get('commit', 'unknown')[:12]}{changed}"),
    ]
    return [(what, value) for what, value in rows if value]


def _when(run: RunData) -> str:
    offset = run.facts.get("wall_offset_ns", "")
    if run.first is None or not offset.lstrip("-").isdecimal() or run.facts.get("level") == "sim":
        return ""
    seconds = (int(offset) + run.first.input.now_ns) // NS_PER_S
    try:
        return datetime.datetime.fromtimestamp(seconds, datetime.UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    except (ValueError, OverflowError, OSError):
        return ""


def object_words(rig: RigConfig) -> str:
    """Return what is pushed in words, "" where the rig does not know it."""
    if rig.base.level == "hardware":
        return ""
    slider = rig.world.slider
    if slider.shape == "circle":
        return f"simulated barrel, {2 * slider.radius_m:g} m across, {slider.mass_kg:g} kg"
    return f"simulated box, {slider.length_m:g} m by {slider.width_m:g} m, {slider.mass_kg:g} kg"
