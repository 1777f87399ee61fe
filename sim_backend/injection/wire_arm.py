"""An emulated UR10 that does something wrong from the start."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sim_backend.injection.injection import padded
from sim_backend.injection.wire_words import WireFault
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.ur10.modes import RobotMode, RuntimeState


def spoil_arm(emulator: UrEmulator, faults: Sequence[WireFault]) -> None:
    """Let the emulator do wrong what `faults` of arm say."""
    for fault in faults:
        _DEEDS[fault.kind](emulator, fault.value)


def _version(arm: UrEmulator, value: tuple[float, ...]) -> None:
    major, minor = f"{value[0]:.2f}".split(".")
    arm.controller.version = (int(major), int(minor), 0, 0)


def _paused(arm: UrEmulator) -> None:
    arm.controller.runtime_state = RuntimeState.PAUSED


def _turn(arm: UrEmulator, value: tuple[float, ...]) -> None:
    turned = [0.0] * 6
    turned[min(max(int(value[0]), 0), 5)] = math.tau
    arm.drift_step(turned)


_DEEDS: dict[str, Callable[[UrEmulator, tuple[float, ...]], None]] = {
    "silent": lambda arm, _: arm.freeze(),
    "lost": lambda arm, _: arm.close(),
    "off": lambda arm, _: arm.mute(),
    "dashboard-silent": lambda arm, _: arm.mute_dashboard(),
    "truncated": lambda arm, value: arm.truncate_all_data(round(value[0])),
    "version": _version,
    "other-model": lambda arm, _: arm.be_model("UR20"),
    "protective-stop": lambda arm, _: arm.protective_stop(),
    "emergency-stop": lambda arm, _: arm.emergency_stop(),
    "safeguard-stop": lambda arm, _: arm.safeguard_stop(),
    "powered-off": lambda arm, _: arm.power_off(),
    "brakes-on": lambda arm, _: arm.set_robot_mode(RobotMode.IDLE),
    "freedrive": lambda arm, _: arm.teach_button(True),
    "other-program": lambda arm, _: arm.play_other_program(),
    "paused-program": lambda arm, _: _paused(arm),
    "garbage": lambda arm, _: arm.nan_joint(0),
    "wrong": lambda arm, value: arm.drift_step(padded(value, 6)),
    "moving": lambda arm, value: arm.drift_rate(padded(value, 6)),
    "drifting": lambda arm, value: arm.drift_rate(padded(value, 6)),
    "turned": _turn,
    "inputs-taken": lambda arm, _: arm.take_inputs(),
}
