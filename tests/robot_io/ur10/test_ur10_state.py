"""What a UR controller's numbers mean, bit by bit, as the RTDE guide has them."""

import pytest

from robot_io.messages import ArmState
from robot_io.ur10.state import UrModes

WELL = {
    "robot_mode": 7,
    "safety_mode": 1,
    "safety_bits": 0b1,
    "status_bits": 0b1,
    "runtime_state": 1,
    "joint_modes": (253,) * 6,
}


def state(own_program=False, **changes):
    return UrModes(**{**WELL, **changes}).state(own_program=own_program)


def test_a_robot_that_stands_holds():
    assert state() == ArmState.HOLDING
    assert state(safety_bits=0b10, safety_mode=2) == ArmState.HOLDING  # reduced
    assert state(status_bits=0b11) == ArmState.HOLDING  # power on, program running


@pytest.mark.parametrize("bit", [5, 6, 7])
def test_emergency_stop_bits(bit):
    assert state(safety_bits=1 | 1 << bit) == ArmState.EMERGENCY_STOP
    assert state(safety_bits=1 | 1 << bit, robot_mode=3, status_bits=0) == ArmState.EMERGENCY_STOP  # the gravest wins


@pytest.mark.parametrize("bit", [2, 3, 4, 8, 9, 10])
def test_other_stop_bits(bit):
    assert state(safety_bits=1 | 1 << bit) == ArmState.PROTECTIVE_STOP


def test_neither_normal_nor_reduced():
    assert state(safety_bits=0) == ArmState.PROTECTIVE_STOP


@pytest.mark.parametrize("mode", range(-1, 11))
def test_safety_modes(mode):
    by_mode = {1: ArmState.HOLDING, 2: ArmState.HOLDING, 6: ArmState.EMERGENCY_STOP, 7: ArmState.EMERGENCY_STOP}
    assert state(safety_mode=mode) == by_mode.get(mode, ArmState.PROTECTIVE_STOP)


@pytest.mark.parametrize("mode", range(-1, 9))
def test_robot_modes(mode):
    assert state(robot_mode=mode) == (ArmState.HOLDING if mode == 7 else ArmState.OFF)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("mode", [239, 252, 255, -1])
def test_one_joint_that_does_not_run(axis, mode):
    modes = tuple(mode if i == axis else 253 for i in range(6))
    assert state(joint_modes=modes) == ArmState.OFF


def test_power_and_teach_button():
    assert state(status_bits=0) == ArmState.OFF
    assert state(status_bits=0b101) == ArmState.MOVING


@pytest.mark.parametrize("runtime", [0, 2, 3, 4, 5])
def test_a_program_is_foreign_unless_it_is_ours(runtime):
    assert state(runtime_state=runtime) == ArmState.FOREIGN_PROGRAM
    assert state(runtime_state=runtime, own_program=True) == ArmState.HOLDING


@pytest.mark.parametrize(
    ("changes", "playing"),
    [
        ({"runtime_state": 2}, True),
        ({"runtime_state": 2, "safety_mode": 2}, True),
        ({"runtime_state": 1}, False),
        ({"runtime_state": 4}, False),
        ({"runtime_state": 2, "robot_mode": 5}, False),
        ({"runtime_state": 2, "safety_mode": 3}, False),
    ],
)
def test_whether_our_script_plays(changes, playing):
    assert UrModes(**{**WELL, **changes}).playing is playing


def test_packed_for_the_log():
    assert UrModes(7, 3, 0xE8000404, 0b101, 2, (253,) * 6).packed() == 0x0404_05_02_03_07
    assert UrModes().packed() == 0xFF
