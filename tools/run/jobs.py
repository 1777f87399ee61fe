"""The jobs of a run's processes: one JSON object each on stdin, descriptors inherited."""

from __future__ import annotations

import msgspec

from tools.places.saved_tare import SavedTare


class ControlJob(msgspec.Struct, frozen=True):
    """Job of `tools.run.control_process`."""

    rig_toml: str
    kind_folder: str
    """Another place to look for the module of the sensor's kind."""
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
    wall_offset_ns: int
    """Wall clock minus CLOCK_MONOTONIC, for stamps in the log."""


class ArmKindJob(msgspec.Struct, frozen=True):
    """Job of `tools.run.arm_process`."""

    rig_toml: str
    kind_folder: str
    launcher_pid: int
    record_fd: int
    run_fd: int
    """EOF on it means that control has ended."""
    status_fd: int


class EmulatorJob(msgspec.Struct, frozen=True):
    """Job of `tools.run.emulator_process`."""

    rig_toml: str
    kind_folder: str
    seed: int
    devices: tuple[str, ...]
    """The emulated devices: any of ft, arm and base."""
    launcher_pid: int
    ring_fd: int
    run_fd: int
    """EOF on it means that control has ended."""
    status_fd: int
