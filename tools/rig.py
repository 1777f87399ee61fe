"""A rig that can be run: loaded, inside the program's ceilings and consistent in itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robot_io.errors import ConfigError
from robot_io.rig.config import RigConfig, load_rig
from robot_io.rig.types import Matrix3

ROTATION_TOLERANCE = 1e-6


def resolve_rig(name_or_path: str | Path, overrides: Sequence[str] = ()) -> RigConfig:
    """Load a rig with its overrides and check all that its types cannot say.

    Raises ConfigError (and UsageError for an override that is not `key=value`).
    """
    from safety import limits

    rig = load_rig(name_or_path, overrides)
    problems = _level_problems(rig) + _address_problems(rig)
    if not is_rotation(rig.frames.base_from_sensor):
        problems.append("`frames.base_from_sensor` is not a rotation (orthonormal rows, determinant +1)")
    if problems:
        raise ConfigError("; ".join(problems), where=str(name_or_path), do="`push config show` prints the resolved rig")
    limits.check(rig)
    return rig


def devices_at(rig: RigConfig, level: str) -> list[str]:
    """Return which of the devices ft, arm and base are at `level` (sim, emulated or hardware)."""
    levels = {"ft": rig.ft.level, "arm": rig.arm.level, "base": rig.base.level}
    return [device for device, its_level in levels.items() if its_level == level]


def is_rotation(rows: Matrix3) -> bool:
    """Tell whether `rows` (3x3) is orthonormal with determinant +1, to 1e-6."""
    x, y, z = rows
    products = [(x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (x, z, 0.0), (y, z, 0.0)]
    orthonormal = all(
        abs(sum(a * b for a, b in zip(left, right, strict=True)) - wanted) <= ROTATION_TOLERANCE
        for left, right, wanted in products
    )
    determinant = (
        x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) + x[2] * (y[0] * z[1] - y[1] * z[0])
    )
    return orthonormal and determinant > 0


def _level_problems(rig: RigConfig) -> list[str]:
    simulated = devices_at(rig, "sim")
    if len(simulated) in (0, 3):
        return []
    others = [device for device in ("ft", "arm", "base") if device not in simulated]
    return [
        f"level `sim` is all three devices or none, and here {' and '.join(simulated)} would be sim beside "
        f"{' and '.join(others)} (level `emulated` mixes with hardware)"
    ]


def _address_problems(rig: RigConfig) -> list[str]:
    addresses = {"ft.port": rig.ft.port, "arm.host": rig.arm.host, "base.url": rig.base.url}
    problems = [
        f"`{key}` is missing, and {key.split('.')[0]} is at level hardware"
        for key, address in addresses.items()
        if not address and key.split(".")[0] in devices_at(rig, "hardware")
    ]
    if "base" in devices_at(rig, "hardware") and rig.base.url and not rig.base.url.startswith("ws://"):
        problems.append(f"`base.url` = {rig.base.url!r} does not start with ws://")
    return problems
