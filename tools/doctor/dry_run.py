"""`push run --dry-run`, which connects to nothing, and `--check`, which is doctor and the same lines."""

from __future__ import annotations

import msgspec

from robot_io.error_report import say_json, tell
from robot_io.errors import DeviceError
from robot_io.rig.config import RigConfig
from tools.doctor.check import NAMES, lines, report, summary_line
from tools.doctor.examine import looked_at
from tools.places.device_locks import FreeDevices
from tools.rig import devices_at
from tools.run.facts.outlook import outlook, tell_bounds, tell_levels


def dry_run(rig: RigConfig, *, as_json: bool) -> int:
    """Tell what would run; return 0."""
    real = devices_at(rig, "hardware")
    checks = [f"{of}.{name}" for of in (*real, "host", "rig") for name in NAMES[of]] if real else []
    _tell(rig)
    tell(f"checked before the start: {', '.join(checks) or 'nothing, because no device is real'}")
    tell("nothing was opened")
    if as_json:
        say_json(outlook(rig) | {"checks": checks, "resolved": msgspec.to_builtins(rig)})
    return 0


def check_only(rig: RigConfig, kind_folder: str, *, as_json: bool) -> int:
    """Look at everything and tell what would run; return 0 without failed checks, else 4."""
    with FreeDevices(rig) as free:
        checks = list(looked_at(rig, kind_folder, held=free.held))
    told = report(rig.name, checks)
    for line in lines(checks):
        tell(line)
    tell(f"doctor: {summary_line(checks)}")
    _tell(rig)
    tell("nothing was moved")
    if as_json:
        say_json(outlook(rig) | {"doctor": told, "resolved": msgspec.to_builtins(rig)})
    return 0 if told["ok"] else DeviceError.exit_code


def _tell(rig: RigConfig) -> None:
    tell_levels(rig)
    tell_bounds(rig)
    tell(f"would push {rig.control.distance_m:g} m at {rig.control.push_speed_m_per_s:g} m/s")
