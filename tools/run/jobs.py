"""What the launcher hands to each process of a run: one JSON object on stdin, descriptors inherited."""

from __future__ import annotations

import msgspec

from tools.places.saved_tare import SavedTare


class ControlJob(msgspec.Struct, frozen=True):
    """For `tools.run.control_process`."""

    rig_toml: str
    kind_folder: str
    """Where else the module of the sensor's kind may be."""
    saved_tare: SavedTare | None
    launcher_pid: int
    gate_fd: int
    base_record_fd: int
    arm_record_fd: int
    ring_fd: int
    operator_fd: int
    status_fd: int
    gate_pidfd: int
    arm_pidfd: int
    recorder_pidfd: int


class ArmKindJob(msgspec.Struct, frozen=True):
    """For `tools.run.arm_process`."""

    rig_toml: str
    kind_folder: str
    launcher_pid: int
    record_fd: int
    status_fd: int


class EmulatorJob(msgspec.Struct, frozen=True):
    """For `tools.run.emulator_process`."""

    rig_toml: str
    kind_folder: str
    seed: int
    devices: tuple[str, ...]
    """Which of ft, arm and base are emulated."""
    launcher_pid: int
    ring_fd: int
    status_fd: int
