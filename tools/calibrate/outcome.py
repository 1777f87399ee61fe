"""What becomes of an estimate: a fragment, the rig that takes it, and what the operator is told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from robot_io.errors import EnvironmentFault
from robot_io.rig.calibration import Calibration
from robot_io.rig.config import RigConfig
from sim_backend.world.truth import true_frames
from tools.calibrate.estimators.estimate import Estimate
from tools.calibrate.raw import Raw
from tools.places.apply_fragment import apply_fragment
from tools.places.atomic_file import write_new
from tools.places.fragment import Fragment, default_path, write_fragment
from tools.rig import devices_at

SCHEMA = 1
ORDER = {
    "bias": "fx, fy, fz, mx, my, mz of the sensor",
    "contact": "ahead, left",
    "marker": "ahead, left, turned to the left",
    "path": "x, y, direction",
}
"""What the values of an estimate of several are."""


class Saved(NamedTuple):
    """The fragment, the readings behind it (None where there are none of its own), and where the rig was kept."""

    fragment: Path
    readings: Path | None
    kept: Path | None


def saved(found: Estimate, rig: RigConfig, raw: Raw | None, out: Path | None, apply: Path | None) -> Saved:
    """Write the fragment and its readings, and let the rig file `apply` include it.

    Raises UsageError, ConfigError and EnvironmentFault as these do.
    """
    made = datetime.now(UTC).replace(microsecond=0)
    uncertainty, residual = (tuple(map(_rounded, values)) for values in (found.uncertainty, found.residual))
    calibration = _as_measured(
        Calibration(
            made,
            _one_or_all(uncertainty),
            found.unit,
            _one_or_all(residual),
            found.source,
            rig.name,
            found.unseen,
        ),
        rig.calibration.made().get(found.what),
    )
    path = out or default_path(found.what, made)
    keys = found.keys | ({} if devices_at(rig, "hardware") else still_hidden(found, rig))
    write_fragment(path, Fragment(found.what, keys, calibration, found.told))
    readings = _write_readings(path.with_suffix(".csv"), raw) if raw is not None and not raw.empty else None
    return Saved(path, readings, apply_fragment(apply, path) if apply is not None else None)


def _as_measured(new: Calibration, before: Calibration | None) -> Calibration:
    """Return the calibration with what it cannot show as old as it is, where it was measured before by other means."""
    if not new.unseen or before is None or before.unseen:
        return new
    since = before.made.date().isoformat()
    source = f"{new.source}; {new.unseen} as of {since}, by {before.source or 'unknown means'}"
    return msgspec.structs.replace(new, made=min(new.made, before.made), source=source, unseen=None)


def _write_readings(path: Path, raw: Raw) -> Path:
    stem, count = path.stem, 2
    while path.exists():  # somebody else's, or of a fragment that is gone
        path, count = path.with_name(f"{stem}-{count}.csv"), count + 1
    try:
        write_new(path, raw.text().encode())
    except OSError as error:
        raise EnvironmentFault(
            f"the readings cannot be written: {error.strerror}", where=str(path), do="Give another --out"
        ) from None
    return path


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


def as_json(found: Estimate, written: Saved, logs: Sequence[Path]) -> dict[str, Any]:
    """Return the object that `--json` prints; its log: the readings, or the logs that were read."""
    return {
        "schema": SCHEMA,
        "what": found.what,
        "value": _one_or_all(found.value),
        "uncertainty": _one_or_all(tuple(map(_rounded, found.uncertainty))),
        "unit": found.unit,
        "residual": _one_or_all(tuple(map(_rounded, found.residual))),
        "file": str(written.fragment),
        "log": [str(log) for log in logs] or (None if written.readings is None else str(written.readings)),
    }


def lines(found: Estimate, written: Saved, apply: Path | None) -> list[str]:
    """Return what people are told: each value with its uncertainty, what several are, then the rest."""
    units = found.unit.split(", ")
    told = [
        f"{found.what}: {value:+.4f} {unit} +- {uncertainty:.2g} (k = 2)"
        for value, uncertainty, unit in zip(found.value, found.uncertainty, units * len(found.value), strict=False)
    ]
    if found.what in ORDER:
        told.append(f"in this order: {ORDER[found.what]}")
    told += [f"by {found.source}", *found.told, f"written to {written.fragment}"]
    if written.kept is not None:
        told.append(f"{apply} includes it now; as it was: {written.kept.name}")
    elif found.keys:
        told.append(
            f'to use it, write include = ["{written.fragment}"] at the top of the rig, or add --apply RIG next time'
        )
    return told


def _less(all_of: Sequence[float], taken: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(a - b, 6) for a, b in zip(all_of, taken, strict=True))


def _rounded(value: float) -> float:
    """Return a value to three digits: of how uncertain something is, more are noise."""
    return float(f"{value:.3g}")


def _one_or_all(values: tuple[float, ...]) -> float | tuple[float, ...]:
    return values[0] if len(values) == 1 else values
