"""Load a rig that can be run: within the program's safety limits and consistent."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from msgspec.structs import replace

from robot_io.errors import ConfigError
from robot_io.rig.config import RigConfig, load_rig
from robot_io.rig.declared import FT300_FACTS, TOOL_FORCE, TOOL_FORCE_FACTS
from robot_io.rig.fault_words import parse_fault
from robot_io.rig.files import shipped_rigs
from robot_io.rig.types import Matrix3
from tools.kinds import is_shipped, query_kinds
from tools.laws import with_law

ROTATION_TOLERANCE = 1e-6
LONGEST_NAME = 64


def resolve_rig(name_or_path: str | Path, overrides: Sequence[str] = ()) -> RigConfig:
    """Load a rig with its overrides, add what its kinds declare, and check what its types cannot express.

    Raises ConfigError (and UsageError for an override that is not `key=value`).
    """
    from safety import limits

    folder = folder_of(name_or_path)
    rig, problems = _with_kinds(with_law(load_rig(name_or_path, overrides), folder), folder)
    rig, more = _with_tool_force(rig)
    problems += more + _name_problems(rig) + _level_problems(rig) + _address_problems(rig) + rig.workspace.problems()
    check_faults(rig)
    if not is_rotation(rig.frames.base_from_sensor):
        problems.append("`frames.base_from_sensor` is not a rotation (orthonormal rows, determinant +1)")
    if problems:
        raise ConfigError("; ".join(problems), where=str(name_or_path), do="`push config show` prints the resolved rig")
    limits.check(rig)
    return rig


def folder_of(name_or_path: str | Path) -> str:
    """Return the folder for modules of a rig's external kinds: its file's folder; for a shipped rig the current one."""
    shipped = str(name_or_path) in shipped_rigs()
    return str(Path.cwd() if shipped else Path(name_or_path).resolve().parent)


def kinds_of(rig: RigConfig) -> dict[str, str]:
    """Return the kind of each device: ft, arm, base."""
    return {"ft": rig.ft.kind, "arm": rig.arm.kind, "base": rig.base.kind}


def _with_kinds(rig: RigConfig, folder: str) -> tuple[RigConfig, list[str]]:
    """Return the rig with its sensor's facts filled in, and the reasons why a kind cannot be used at its level."""
    rig = replace(rig, ft=replace(rig.ft, declared=FT300_FACTS))
    own = {device: kind for device, kind in kinds_of(rig).items() if not is_shipped(device, kind)}
    if not own:
        return rig, []
    declared_by = query_kinds(own, folder)
    if "ft" in declared_by and declared_by["ft"].facts is not None:
        rig = replace(rig, ft=replace(rig.ft, declared=declared_by["ft"].facts))
    problems = [
        f"`{own[device]}` has no emulator, and {device} is at level emulated"
        for device in devices_at(rig, "emulated")
        if device in declared_by and not declared_by[device].emulated
    ]
    problems += [
        f"`{own[device]}` cannot be simulated at level sim (an external sensor can, an external arm or base cannot)"
        for device in devices_at(rig, "sim")
        if device in declared_by and device != "ft"
    ]
    return rig, problems


def _with_tool_force(rig: RigConfig) -> tuple[RigConfig, list[str]]:
    """Return the rig with facts and address of its arm's own sensor filled in, and what is wrong with them."""
    if rig.ft.kind != TOOL_FORCE:
        return rig, []
    model = str(rig.ft.options.get("model", ""))
    problems = []
    if model not in TOOL_FORCE_FACTS:
        cb3 = f"{model} is none: a CB3 arm only estimates forces" if model in ("UR3", "UR5", "UR10") else "is missing"
        problems.append(f"`ft.options.model` {cb3}; {TOOL_FORCE} is the sensor of a {', '.join(TOOL_FORCE_FACTS)}")
    if rig.arm.kind != "ur":
        problems.append(f"`arm.kind` = {rig.arm.kind!r}, and {TOOL_FORCE} is the sensor of a `ur`")
    if rig.ft.level != rig.arm.level:
        problems.append(f"{TOOL_FORCE} is the arm's own sensor, so `ft.level` must be the arm's, {rig.arm.level!r}")
    if rig.ft.port not in ("", rig.arm.host):
        problems.append(f"`ft.port` is not needed: {TOOL_FORCE} is at `arm.host`")
    facts = TOOL_FORCE_FACTS.get(model, rig.ft.declared)
    return replace(rig, ft=replace(rig.ft, declared=facts, port=rig.arm.host)), problems


def devices_at(rig: RigConfig, level: str) -> list[str]:
    """Return which of the devices ft, arm and base are at `level` (sim, emulated or hardware)."""
    levels = {"ft": rig.ft.level, "arm": rig.arm.level, "base": rig.base.level}
    return [device for device, its_level in levels.items() if its_level == level]


def with_faults(rig: RigConfig, words: Sequence[str]) -> RigConfig:
    """Return the rig with more faults to inject. Raises ConfigError as `check_faults`."""
    rig = replace(rig, faults=replace(rig.faults, inject=(*rig.faults.inject, *words)))
    check_faults(rig)
    return rig


def check_faults(rig: RigConfig) -> None:
    """Raise ConfigError for a fault to inject that cannot be read, or where a device is real."""
    for word in rig.faults.inject:
        parse_fault(word)
    real = devices_at(rig, "hardware")
    if rig.faults.inject and real:
        raise ConfigError(
            f"no fault is injected where a device is real, and {' and '.join(real)} "
            f"{'is' if len(real) == 1 else 'are'} at level hardware",
            where=f"rig {rig.name!r}",
            do="Inject faults at level sim or emulated",
        )


def faults_of(rig: RigConfig, device: str) -> tuple[str, ...]:
    """Return the faults to inject into a device: ft, arm or base."""
    return tuple(word for word in rig.faults.inject if parse_fault(word).device.split(".")[0] == device)


def is_rotation(rows: Matrix3) -> bool:
    """Return whether `rows` (3x3) is orthonormal with determinant +1, to 1e-6."""
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


def _name_problems(rig: RigConfig) -> list[str]:
    """A rig's name becomes part of the names of folders and files."""
    if re.fullmatch(r"\w[\w .+-]*", rig.name) and len(rig.name) <= LONGEST_NAME:
        return []
    return [
        f"`name` = {rig.name!r} is not a name: letters, digits, spaces and the signs - + . _ are, "
        f"at most {LONGEST_NAME} of them, the first a letter or a digit"
    ]


def _level_problems(rig: RigConfig) -> list[str]:
    simulated = devices_at(rig, "sim")
    if len(simulated) in (0, 3):
        return []
    others = [device for device in ("ft", "arm", "base") if device not in simulated]
    return [
        f"level `sim` is for all three devices or none; here {' and '.join(simulated)} would be sim and "
        f"{' and '.join(others)} not (level `emulated` can be mixed with hardware)"
    ]


def _address_problems(rig: RigConfig) -> list[str]:
    addresses = {"ft.port": rig.ft.port, "arm.host": rig.arm.host, "base.url": rig.base.url}
    # Only an external driver itself knows what it needs as its address.
    shipped = [device for device in devices_at(rig, "hardware") if is_shipped(device, kinds_of(rig)[device])]
    problems = [
        f"`{key}` is missing, and {key.split('.')[0]} is at level hardware"
        for key, address in addresses.items()
        if not address and key.split(".")[0] in shipped
    ]
    if "base" in shipped and rig.base.url and not rig.base.url.startswith(("ws://", "wss://")):
        problems.append(f"`base.url` = {rig.base.url!r} does not start with ws:// or wss://")
    return problems


def with_addresses(rig: RigConfig, addresses: dict[str, str]) -> RigConfig:
    """Return the rig with the addresses of its emulators filled in."""
    if "ft" in addresses:
        rig = replace(rig, ft=replace(rig.ft, port=addresses["ft"]))
    if "arm" in addresses:
        rig = replace(rig, arm=replace(rig.arm, host=addresses["arm"]))
    if "base" in addresses:
        rig = replace(rig, base=replace(rig.base, url=addresses["base"]))
    return rig
