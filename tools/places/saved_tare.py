"""A tare saved for `--start-in-contact`: valid for the same sensor while it stays powered.

The FT 300 has no power-on counter, so a saved tare is valid only until this machine reboots and for half a day; an
emulated or simulated sensor counts as powered while its settings stay the same.
"""

from __future__ import annotations

import hashlib
import time
from pathlib import Path

import msgspec

from robot_io.errors import UsageError
from robot_io.messages import Vector6
from robot_io.rig.config import RigConfig
from tools.places.atomic_file import write_atomically
from tools.places.state_dir import file_name, state_dir

MAX_AGE_S = 12 * 3600.0


class SavedTare(msgspec.Struct, frozen=True):
    """Bias in N and N*m (SENSOR frame), and what it is valid for: joint positions of the arm (rad) and power cycle."""

    bias: Vector6
    joints: Vector6
    power_cycle: str
    saved_s: float


def power_cycle(rig: RigConfig) -> str:
    """Return an identifier of the sensor's power cycle."""
    if rig.ft.level == "hardware":
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{rig.ft.port} {boot} {_digest((rig.ft.kind, rig.ft.options, rig.ft.declared))}"
    world = (rig.world.sensor, rig.world.truth, rig.frames, rig.arm.held_pose_rad)
    return _digest((rig.ft.kind, rig.ft.options, rig.ft.declared, *world))


def _digest(parts: object) -> str:
    return hashlib.sha256(msgspec.json.encode(parts)).hexdigest()


def save(rig: RigConfig, bias: Vector6, joints: Vector6) -> None:
    """Save a tare for later runs of this rig. Raises OSError and EnvironmentFault."""
    tare = SavedTare(bias, joints, power_cycle(rig), time.time())
    write_atomically(_path(rig), msgspec.json.encode(tare), mode=0o600)


def load(rig: RigConfig) -> SavedTare:
    """Return the saved tare. Raises UsageError if there is no valid one."""
    try:
        tare = msgspec.json.decode(_path(rig).read_bytes(), type=SavedTare)
    except (OSError, msgspec.MsgspecError):
        tare = None
    age_s = time.time() - tare.saved_s if tare else 0.0
    if tare is None or tare.power_cycle != power_cycle(rig) or not 0.0 <= age_s <= MAX_AGE_S:
        raise UsageError(
            "--start-in-contact needs a tare saved in this power cycle of the sensor, and there is none",
            where=rig.name,
            do="Run a push that starts out of contact first; it saves one",
        )
    return tare


def _path(rig: RigConfig) -> Path:
    return state_dir() / f"{file_name(rig.name)}.tare.json"
