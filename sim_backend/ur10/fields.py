"""The RTDE variables of a UR controller: name, type on the wire, and how the emulator reads or writes the value.

Source: Universal Robots RTDE guide. Clients decode by their own table, so the types must be the documented ones.
Quantities that are not modelled are constants of a healthy robot at rest.
"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from sim_backend.ur10.controller import UrController
from sim_backend.ur10.kinematics import flange_pose
from sim_backend.ur10.models import Version
from sim_backend.ur10.modes import RobotMode, joint_mode, robot_status_bits, safety_bits
from sim_backend.ur10.registers import REGISTERS

Value = int | float | bool
Values = tuple[Value, ...]

WIRE_FORMAT = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "INT32": "i",
    "UINT64": "Q",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
"""Type name -> code of the struct module (big-endian, packed)."""


class Output(msgspec.Struct, frozen=True):
    """A variable clients can read."""

    type: str
    read: Callable[[UrController], Values]


class Input(msgspec.Struct, frozen=True):
    """A variable one client at a time can write."""

    type: str
    write: Callable[[UrController, Values, int], None]


def output_field(name: str, version: Version) -> Output | None:
    """Return the output called `name` in a version of PolyScope, or None (NOT_FOUND)."""
    return _OUTPUTS.get(name) if version >= _SINCE.get(name, version) else None


def input_field(name: str) -> Input | None:
    """Return the input called `name`, or None (NOT_FOUND)."""
    return _INPUTS.get(name)


def _constant(type_name: str, *values: Value) -> Output:
    return Output(type_name, lambda _robot: values)


def _zeros(type_name: str) -> Output:
    return _constant(type_name, *(0.0,) * int(type_name[6]))


def _wrench(robot: UrController) -> Values:
    return robot.tcp_force


def _pose(robot: UrController) -> Values:
    return flange_pose(robot.motion.actual, robot.model)


def _joint_modes(robot: UrController) -> Values:
    return (joint_mode(robot.robot_mode, robot.safety_mode),) * 6


def _robot_status(robot: UrController) -> Values:
    return (robot_status_bits(robot.robot_mode, robot.runtime_state, robot.teach_button),)


def _arm_voltage(robot: UrController) -> Values:
    return (48.0 if robot.robot_mode >= RobotMode.POWER_ON else 0.0,)


_OUTPUTS: dict[str, Output] = {
    "timestamp": Output("DOUBLE", lambda r: (r.time_s,)),
    "target_q": Output("VECTOR6D", lambda r: r.motion.target),
    "target_qd": Output("VECTOR6D", lambda r: r.motion.velocity),
    "target_qdd": _zeros("VECTOR6D"),
    "target_current": _constant("VECTOR6D", 0.0, 4.6, 2.4, 0.4, 0.0, 0.0),
    "target_moment": _constant("VECTOR6D", 0.0, 60.0, 30.0, 4.0, 0.0, 0.0),
    "actual_q": Output("VECTOR6D", lambda r: r.reported_q),
    "actual_qd": Output("VECTOR6D", lambda r: r.motion.velocity),
    "actual_current": _constant("VECTOR6D", 0.05, 4.6, 2.4, 0.4, 0.05, 0.02),
    "joint_control_output": _constant("VECTOR6D", 0.05, 4.6, 2.4, 0.4, 0.05, 0.02),
    "actual_TCP_pose": Output("VECTOR6D", _pose),
    "actual_TCP_speed": _zeros("VECTOR6D"),
    "actual_TCP_force": Output("VECTOR6D", _wrench),
    "target_TCP_pose": Output("VECTOR6D", _pose),
    "target_TCP_speed": _zeros("VECTOR6D"),
    "actual_digital_input_bits": _constant("UINT64", 0),
    "joint_temperatures": _constant("VECTOR6D", 31.0, 32.0, 32.0, 34.0, 35.0, 35.0),
    "actual_execution_time": _constant("DOUBLE", 0.4),
    "robot_mode": Output("INT32", lambda r: (int(r.robot_mode),)),
    "joint_mode": Output("VECTOR6INT32", _joint_modes),
    "safety_mode": Output("INT32", lambda r: (int(r.safety_mode),)),
    "safety_status": Output("INT32", lambda r: (int(r.safety_status),)),
    "actual_tool_accelerometer": _constant("VECTOR3D", 0.0, -9.8, 0.0),
    "speed_scaling": _constant("DOUBLE", 1.0),
    "target_speed_fraction": _constant("DOUBLE", 1.0),
    "actual_momentum": _constant("DOUBLE", 0.0),
    "actual_main_voltage": _constant("DOUBLE", 48.0),
    "actual_robot_voltage": Output("DOUBLE", _arm_voltage),
    "actual_robot_current": _constant("DOUBLE", 0.8),
    "actual_joint_voltage": _constant("VECTOR6D", *(47.5,) * 6),
    "actual_digital_output_bits": _constant("UINT64", 0),
    "runtime_state": Output("UINT32", lambda r: (int(r.runtime_state),)),
    "elbow_position": _zeros("VECTOR3D"),
    "elbow_velocity": _zeros("VECTOR3D"),
    "robot_status_bits": Output("UINT32", _robot_status),
    "safety_status_bits": Output("UINT32", lambda r: (safety_bits(r.safety_mode),)),
    "analog_io_types": _constant("UINT32", 0),
    "standard_analog_input0": _constant("DOUBLE", 0.0),
    "standard_analog_input1": _constant("DOUBLE", 0.0),
    "standard_analog_output0": _constant("DOUBLE", 0.0),
    "standard_analog_output1": _constant("DOUBLE", 0.0),
    "io_current": _constant("DOUBLE", 0.0),
    "euromap67_input_bits": _constant("UINT32", 0),
    "euromap67_output_bits": _constant("UINT32", 0),
    "euromap67_24V_voltage": _constant("DOUBLE", 0.0),
    "euromap67_24V_current": _constant("DOUBLE", 0.0),
    "tool_mode": _constant("UINT32", 253),
    "tool_analog_input_types": _constant("UINT32", 0),
    "tool_analog_input0": _constant("DOUBLE", 0.0),
    "tool_analog_input1": _constant("DOUBLE", 0.0),
    "tool_output_voltage": _constant("INT32", 0),
    "tool_output_current": _constant("DOUBLE", 0.0),
    "tool_temperature": _constant("DOUBLE", 36.0),
    "tcp_force_scalar": Output("DOUBLE", lambda r: (sum(f * f for f in r.tcp_force[:3]) ** 0.5,)),
    "ft_raw_wrench": Output("VECTOR6D", lambda r: r.raw_wrench),
    "tcp_offset": Output("VECTOR6D", lambda r: r.tcp_offset),
    "payload": Output("DOUBLE", lambda r: (r.payload_kg,)),
    "payload_cog": Output("VECTOR3D", lambda r: r.payload_cog_m),
    "payload_inertia": _zeros("VECTOR6D"),
    "output_bit_registers0_to_31": _constant("UINT32", 0),
    "output_bit_registers32_to_63": _constant("UINT32", 0),
}

_SINCE: dict[str, Version] = {"ft_raw_wrench": (5, 9, 0, 0)}
"""From which version on there is an output that older ones do not have."""


def _discard(_robot: UrController, _values: Values, _now_ns: int) -> None:
    """Accept and ignore a value that has no effect on this robot."""


def _set_wrench(robot: UrController, values: Values, _now_ns: int) -> None:
    a, b, c, d, e, f = (float(v) for v in values)
    robot.external_wrench = (a, b, c, d, e, f)


_INPUTS: dict[str, Input] = {
    "speed_slider_mask": Input("UINT32", _discard),
    "speed_slider_fraction": Input("DOUBLE", _discard),
    "standard_digital_output_mask": Input("UINT8", _discard),
    "standard_digital_output": Input("UINT8", _discard),
    "configurable_digital_output_mask": Input("UINT8", _discard),
    "configurable_digital_output": Input("UINT8", _discard),
    "tool_digital_output_mask": Input("UINT8", _discard),
    "tool_digital_output": Input("UINT8", _discard),
    "standard_analog_output_mask": Input("UINT8", _discard),
    "standard_analog_output_type": Input("UINT8", _discard),
    "standard_analog_output_0": Input("DOUBLE", _discard),
    "standard_analog_output_1": Input("DOUBLE", _discard),
    "external_force_torque": Input("VECTOR6D", _set_wrench),
}


def _add_registers(i: int) -> None:
    def write_int(robot: UrController, values: Values, now_ns: int) -> None:
        robot.registers.write_int(i, int(values[0]), now_ns)

    def write_double(robot: UrController, values: Values, _now_ns: int) -> None:
        robot.registers.double_in[i] = float(values[0])

    _OUTPUTS[f"output_int_register_{i}"] = Output("INT32", lambda r: (r.registers.int_out[i],))
    _OUTPUTS[f"output_double_register_{i}"] = Output("DOUBLE", lambda r: (r.registers.double_out[i],))
    _OUTPUTS[f"input_int_register_{i}"] = Output("INT32", lambda r: (r.registers.int_in[i],))
    _OUTPUTS[f"input_double_register_{i}"] = Output("DOUBLE", lambda r: (r.registers.double_in[i],))
    _INPUTS[f"input_int_register_{i}"] = Input("INT32", write_int)
    _INPUTS[f"input_double_register_{i}"] = Input("DOUBLE", write_double)


def _add_bits(name: str, type_name: str, first: int, count: int) -> None:
    """Add the input bits first..first+count-1 as one number."""

    def write(robot: UrController, values: Values, _now_ns: int) -> None:
        robot.registers.bits_in[first : first + count] = [bool(int(values[0]) >> i & 1) for i in range(count)]

    def read(robot: UrController) -> Values:
        return (sum(bit << i for i, bit in enumerate(robot.registers.bits_in[first : first + count])),)

    _OUTPUTS[name] = Output(type_name, read)
    _INPUTS[name] = Input(type_name, write)


_add_bits("input_bit_registers0_to_31", "UINT32", 0, 32)
_add_bits("input_bit_registers32_to_63", "UINT32", 32, 32)
for _index in range(REGISTERS):
    _add_registers(_index)
for _index in range(64, 128):
    _OUTPUTS[f"output_bit_register_{_index}"] = _constant("BOOL", False)
    _add_bits(f"input_bit_register_{_index}", "BOOL", _index, 1)
