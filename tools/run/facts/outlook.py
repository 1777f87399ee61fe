"""What a run of a rig would open and do, told before it."""

from __future__ import annotations

from typing import Any

from robot_io.error_report import tell
from robot_io.rig.config import RigConfig
from tools.kinds import device_names
from tools.rig import devices_at
from tools.run.facts.bounds import bounds_lines, bounds_of


def tell_levels(rig: RigConfig) -> None:
    """Tell the level of each device, and the address of the real ones."""
    for device, level in (("ft", rig.ft.level), ("arm", rig.arm.level), ("base", rig.base.level)):
        where = {"ft": rig.ft.port, "arm": rig.arm.host, "base": rig.base.url}[device]
        tell(f"{device:<5} {level:<9} {where if level == 'hardware' else ''}".rstrip())


def blind_words(rig: RigConfig) -> str:
    """Return in words what a real base does not feel, "" where all its devices are real or it is not real itself."""
    emulated = devices_at(rig, "emulated")
    if rig.base.level != "hardware" or not emulated:
        return ""
    verb = "is" if len(emulated) == 1 else "are"
    return f"the real base moves blind: {' and '.join(emulated)} of its rig {verb} only emulated"


def tell_bounds(rig: RigConfig) -> None:
    """Tell what bounds the motion of a run."""
    for line in (*bounds_lines(rig), *filter(None, [blind_words(rig)])):
        tell(line)


def outlook(rig: RigConfig) -> dict[str, Any]:
    """Return what would run, as `push run --dry-run --json` prints it."""
    sensor, arm, base = device_names(rig)
    return {
        "schema": 1,
        "dry_run": True,
        "rig": rig.name,
        "devices": {
            sensor: {"level": rig.ft.level, "port": rig.ft.port},
            arm: {"level": rig.arm.level, "host": rig.arm.host, "hold": rig.arm.hold},
            base: {"level": rig.base.level, "url": rig.base.url},
        },
        "distance_m": rig.control.distance_m,
        "law": rig.control.law,
        "push_speed_m_per_s": rig.control.push_speed_m_per_s,
        "bounds": bounds_of(rig),
    }
