"""Finds the run under way that `push watch` attaches to: one on the rig's real devices, or one of the same rig."""

from __future__ import annotations

from pathlib import Path

from robot_io.rig.config import RigConfig
from tools.places.device_locks import resources_of
from tools.places.running import RunningRun, running_runs


def run_to_watch(rig: RigConfig) -> RunningRun | None:
    """Return the latest run on the rig's devices, None if there is none.

    Emulated and simulated devices belong to one run alone: there the rig's name counts.
    """
    keys = {resource.key for resource in resources_of(rig)}
    found = [run for run in running_runs() if run.log and Path(run.log).exists() and _concerns(run, rig, keys)]
    return max(found, key=lambda run: max(process.started for process in run.processes.values()), default=None)


def _concerns(run: RunningRun, rig: RigConfig, keys: set[str]) -> bool:
    return not keys.isdisjoint(run.devices) if keys else run.rig == rig.name
