"""What becomes of an estimate: a fragment, the rig that takes it, and what the operator is told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from robot_io.rig.calibration import Calibration
from robot_io.rig.config import RigConfig
from sim_backend.world.truth import true_frames
from tools.calibrate.estimators.estimate import Estimate
from tools.places.apply_fragment import apply_fragment
from tools.places.fragment import Fragment, default_path, write_fragment
from tools.rig import devices_at

SCHEMA = 1


def saved(found: Estimate, rig: RigConfig, out: Path | None, apply: Path | None) -> tuple[Path, Path | None]:
    """Write the fragment and let the rig file `apply` include it; return the fragment and where the rig was kept.

    Raises UsageError, ConfigError and EnvironmentFault as these do.
    """
    made = datetime.now(UTC).replace(microsecond=0)
    uncertainty, residual = (tuple(map(_rounded, values)) for values in (found.uncertainty, found.residual))
    calibration = Calibration(made, _one_or_all(uncertainty), found.unit, _one_or_all(residual), found.source, rig.name)
    path = out or default_path(found.what, made)
    keys = found.keys | (still_hidden(found, rig) if devices_at(rig, "emulated") else {})
    write_fragment(path, Fragment(found.what, keys, calibration, found.told))
    return path, apply_fragment(apply, path) if apply is not None else None


def still_hidden(found: Estimate, rig: RigConfig) -> dict[str, Any]:
    """Return the keys of `[world.truth]` by which an emulated world stays as it is when the rig takes new frames.

    Its errors are against the frames, so they would move along. Of a new mounting only the yaw can be told.
    """
    true, new = true_frames(rig), found.keys
    if (rows := new.get("frames.base_from_sensor")) is not None:
        left = np.array(true.base_from_sensor) @ np.array(rows).T
        return {"world.truth.sensor_yaw_deg": round(math.degrees(math.atan2(left[1, 0], left[0, 0])), 6)}
    if (contact := new.get("frames.contact_in_base_m")) is not None:
        return {"world.truth.contact_offset_m": _less(true.contact_in_base_m[:2], contact[:2])}
    if (marker := new.get("frames.base_from_marker")) is not None:
        return {"world.truth.marker_offset": _less(true.base_from_marker, marker)}
    return {}


def as_json(found: Estimate, path: Path, logs: Sequence[Path]) -> dict[str, Any]:
    """Return the object that `--json` prints."""
    return {
        "schema": SCHEMA,
        "what": found.what,
        "value": _one_or_all(found.value),
        "uncertainty": _one_or_all(tuple(map(_rounded, found.uncertainty))),
        "unit": found.unit,
        "residual": _one_or_all(tuple(map(_rounded, found.residual))),
        "file": str(path),
        "log": [str(log) for log in logs] or None,
    }


def lines(found: Estimate, path: Path, kept: Path | None, apply: Path | None) -> list[str]:
    """Return what people are told: each value with its uncertainty, then the rest."""
    units = found.unit.split(", ")
    told = [
        f"{found.what}: {value:+.4f} {unit} +- {uncertainty:.2g} (k = 2)"
        for value, uncertainty, unit in zip(found.value, found.uncertainty, units * len(found.value), strict=False)
    ]
    told += [f"by {found.source}", *found.told, f"written to {path}"]
    if kept is not None:
        told.append(f"{apply} includes it now; as it was: {kept.name}")
    elif found.keys:
        told.append(f'to use it, write include = ["{path}"] at the top of the rig, or add --apply RIG next time')
    return told


def _less(all_of: Sequence[float], taken: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(a - b, 6) for a, b in zip(all_of, taken, strict=True))


def _rounded(value: float) -> float:
    """Return a value to three digits: of how uncertain something is, more are noise."""
    return float(f"{value:.3g}")


def _one_or_all(values: tuple[float, ...]) -> float | tuple[float, ...]:
    return values[0] if len(values) == 1 else values
