"""Summarise a run from its log alone: key figures, settings that differ, timing, counters."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np

from control.notes.run_notes import outcome
from robot_io.rig.config import RigConfig, load_rig
from robot_io.rig.files import shipped_rigs
from robot_io.tick import Phase
from tools.kinds import device_names
from tools.report.bounded_series import Floats
from tools.report.drawing.style import phase_spans
from tools.report.run_data import RunData


def tiles(run: RunData) -> list[tuple[str, str]]:
    """Return the key figures of the run as pairs (quantity, value with unit)."""
    if run.last is None:
        return [("log", f"{run.messages} messages"), ("length", f"{run.duration_s:.1f} s")]
    last = run.last
    end = outcome(last.input, last.after, last.output)
    control = last.after.control
    ticks = run.ticks
    size = np.hypot(ticks["force_x"], ticks["force_y"])
    pushing = (ticks["phase"] == Phase.PUSH) & np.isfinite(size)
    pushed_s = sum(until - since for phase, since, until in phase_spans(ticks) if phase == Phase.PUSH)
    raw = ticks["force_raw"]
    found = [
        ("distance", f"{end['distance_m']:.3f} of {run.rig.control.distance_m:g} m"),
        ("lateral error at the end", f"{end['lateral_error_m']:+.3f} m"),
        ("maximum deviation", _number(_largest_deviation(ticks["lateral_m"][pushing]), "m", "+.3f")),
        ("time pushing", f"{pushed_s:.1f} s"),
        ("median force while pushing", _number(float(np.median(size[pushing])) if pushing.any() else math.nan, "N")),
        ("maximum force", _number(float(np.nanmax(raw)) if np.isfinite(raw).any() else math.nan, "N")),
        ("sensor after the push", _number(control.residual_N, "N from zero", ".2f")),
        ("ticks skipped", f"{run.skipped} of {run.tick_count + run.skipped}"),
    ]
    return [(what, value) for what, value in found if value]


def baseline_of(rig: RigConfig) -> str:
    """Return the shipped rig to compare settings with: the one of the same name, else the one of the same level."""
    if rig.name in shipped_rigs():
        return rig.name
    levels = {rig.ft.level, rig.arm.level, rig.base.level}
    return "thing" if "hardware" in levels else "sim" if "sim" in levels else "emulated"


def differences(rig: RigConfig, baseline: str) -> list[tuple[str, str, str]]:
    """Return (setting, shipped value, this run's value) for every setting that differs."""
    ours, theirs = flat_settings(msgspec.to_builtins(rig)), flat_settings(msgspec.to_builtins(load_rig(baseline)))
    names = dict.fromkeys((*theirs, *ours))
    return [
        (name, str(theirs.get(name, "-")), str(ours.get(name, "-")))
        for name in names
        if ours.get(name) != theirs.get(name) and name != "description"
    ]


def timing_rows(run: RunData) -> list[tuple[str, str]]:
    """Return the loop's timing as pairs (quantity, value)."""
    if not run.late.total or run.first is None or run.last is None:
        return []
    late = run.late
    span_s = (run.last.input.now_ns - run.first.input.now_ns) * 1e-9
    steps = run.last.input.tick - run.first.input.tick
    rows = [
        ("rate, configured", f"{run.rig.loop.rate_hz:g} Hz"),
        ("rate, measured", f"{steps / span_s:.3f} Hz" if span_s > 0 else "-"),
        ("ticks", str(run.tick_count)),
        ("ticks skipped", str(run.skipped)),
        ("lateness, median", f"{late.percentile_ms(50):.2f} ms"),
        ("lateness, 99th percentile", f"{late.percentile_ms(99):.2f} ms"),
        ("lateness, 99.9th percentile", f"{late.percentile_ms(99.9):.2f} ms"),
        ("lateness, maximum", f"{late.worst_ms:.2f} ms"),
    ]
    dropped = run.last.input.host.log_dropped
    return [*rows, ("records that did not fit into the log", str(dropped))]


def counters(run: RunData, summary: dict[str, Any]) -> dict[str, list[tuple[str, str]]]:
    """Return pairs (counter, value) per device: the driver's counts if the summary has them, else the last tick's."""
    sensor, arm_name, base_name = names = device_names(run.rig)
    found: dict[str, dict[str, Any]] = {name: {} for name in names}
    if run.last is not None:
        ft, arm, base = run.last.input.ft, run.last.input.arm, run.last.input.base
        found[sensor] = {"packets_ok": ft.packets_ok, "crc_fail": ft.crc_fail, "junk_bytes": ft.junk_bytes}
        found[arm_name] = {"packets": arm.packets}
        found[base_name] = {"pose": base.pose_seq, "odometry": base.odometry_seq}
    counted = summary.get("devices")
    for device in found:
        if isinstance(counted, dict) and isinstance(counted.get(device), dict):
            found[device].update(counted[device])
    rows = {}
    for (device, values), age in zip(found.items(), run.ages.values(), strict=True):
        rows[device] = [(str(name).replace("_", " "), str(value)) for name, value in list(values.items())[:100]]
        if age.total:
            rows[device] += [
                ("age of newest data, median", f"{age.percentile_ms(50):.1f} ms"),
                ("age of newest data, 99th percentile", f"{age.percentile_ms(99):.1f} ms"),
                ("age of newest data, maximum", f"{age.worst_ms:.1f} ms"),
            ]
    return rows


def _number(value: float, unit: str, form: str = ".1f") -> str:
    return f"{value:{form}} {unit}" if math.isfinite(value) else ""


def _largest_deviation(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite[np.argmax(np.abs(finite))]) if len(finite) else math.nan


def flat_settings(tree: Any, name: str = "") -> dict[str, Any]:
    """Return the settings of a rig (as built-in types) by their full names."""
    if not isinstance(tree, dict):
        return {name: tree}
    found: dict[str, Any] = {}
    for key, value in tree.items():
        found |= flat_settings(value, f"{name}.{key}" if name else str(key))
    return found
