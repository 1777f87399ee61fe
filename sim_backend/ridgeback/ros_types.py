"""The ROS message types that the emulated bridge knows, and the checks that a real one applies to a message's fields.

Checks as observed: a missing field is zero, an int is accepted as a float, and so are NaN and infinity; a string,
boolean, null or list in place of a number, or a field the type does not have, makes the message invalid. A header
without stamp gets the robot's time (ROS 1 always, ROS 2 only when the header itself is there).
Source of the definitions: the .msg files of std_msgs, geometry_msgs, nav_msgs, sensor_msgs, ridgeback_msgs.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

RosTime = tuple[int, int]
Fields = tuple[tuple[str, str], ...]

_INTS = {"uint8": (0, 2**8 - 1), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}
_ROS1_NAME = re.compile(r"^[A-Za-z]\w*/[A-Za-z]\w*$")
_ROS2_NAME = re.compile(r"^([A-Za-z]\w*)/(?:msg/)?([A-Za-z]\w*)$")


def fields_in(text: str) -> Fields:
    """Return the (name, type) of each field in "type name, type name"."""
    pairs = (item.split() for item in text.split(",") if item)
    return tuple((name, kind) for kind, name in pairs)


_XYZ = fields_in("float64 x, float64 y, float64 z")

DEFINITIONS: dict[str, Fields] = {
    "std_msgs/Header": (),  # its fields depend on the ROS version
    "std_msgs/Empty": (),
    "std_msgs/Bool": fields_in("bool data"),
    "std_msgs/Int32": fields_in("int32 data"),
    "std_msgs/Float64": fields_in("float64 data"),
    "std_msgs/String": fields_in("string data"),
    "geometry_msgs/Vector3": _XYZ,
    "geometry_msgs/Point": _XYZ,
    "geometry_msgs/Quaternion": fields_in("float64 x, float64 y, float64 z, float64 w"),
    "geometry_msgs/Twist": fields_in("geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular"),
    "geometry_msgs/TwistStamped": fields_in("std_msgs/Header header, geometry_msgs/Twist twist"),
    "geometry_msgs/Pose": fields_in("geometry_msgs/Point position, geometry_msgs/Quaternion orientation"),
    "geometry_msgs/PoseStamped": fields_in("std_msgs/Header header, geometry_msgs/Pose pose"),
    "geometry_msgs/PoseWithCovariance": fields_in("geometry_msgs/Pose pose, float64[36] covariance"),
    "geometry_msgs/TwistWithCovariance": fields_in("geometry_msgs/Twist twist, float64[36] covariance"),
    "geometry_msgs/Transform": fields_in("geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation"),
    "geometry_msgs/TransformStamped": fields_in(
        "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform"
    ),
    "nav_msgs/Odometry": fields_in(
        "std_msgs/Header header, string child_frame_id, geometry_msgs/PoseWithCovariance pose, "
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "sensor_msgs/JointState": fields_in(
        "std_msgs/Header header, string[] name, float64[] position, float64[] velocity, float64[] effort"
    ),
    "ridgeback_msgs/Status": fields_in(
        "std_msgs/Header header, string hardware_id, duration mcu_uptime, duration connection_uptime, "
        "float32 pcb_temperature, float32 mcu_temperature, bool stop_power_status, bool stop_engaged, "
        "bool drivers_active, bool external_stop_present, bool charger_connected, bool charging_complete, "
        "float32 measured_battery, float32 measured_12v, float32 measured_5v, float32 measured_inverter, "
        "float32 measured_front_axle, float32 measured_rear_axle, float32 measured_light, float32 total_current, "
        "float32 total_current_peak, float64 total_power_consumed"
    ),
}


class BadMessage(Exception):
    """A message that the bridge drops; the text would go to the robot's log."""


class RosTypes:
    """Type names and message checks of one ROS version (1 or 2). `now` gives the robot's time (s, ns)."""

    def __init__(self, ros_version: int, now: Callable[[], RosTime]) -> None:
        self.ros_version = ros_version
        self._ros2 = ros_version == 2
        self._now = now

    def canonical(self, name: object) -> str | None:
        """Return the type's name as this ROS version spells it, or None if it is unknown."""
        if not isinstance(name, str):
            return None
        if not self._ros2:
            return name if _ROS1_NAME.match(name) and name in DEFINITIONS else None
        match = _ROS2_NAME.match(name)
        if match is None or f"{match[1]}/{match[2]}" not in DEFINITIONS:
            return None
        return f"{match[1]}/msg/{match[2]}"

    def time(self, stamp: RosTime) -> dict[str, int]:
        """Return a time in this ROS version's format."""
        return {"sec": stamp[0], "nanosec": stamp[1]} if self._ros2 else {"secs": stamp[0], "nsecs": stamp[1]}

    def filled(self, type_name: str, message: object) -> dict[str, Any]:
        """Check a message and fill in missing fields. Raises BadMessage."""
        filled: dict[str, Any] = self._value(type_name.replace("/msg/", "/"), message, type_name)
        return filled

    def full_text(self, type_name: str) -> str:
        """Return a type's definition with all nested types, as `gendeps --cat` prints it (genmsg)."""
        kind = type_name.replace("/msg/", "/")
        kinds, texts = [kind], list[str]()
        for nested in kinds:  # grows while it is iterated
            fields = self.fields_of(nested)
            texts.append("".join(f"{field} {name}\n" for name, field in fields))
            kinds += dict.fromkeys(field for _, field in fields if "/" in field and field not in kinds)
        return f"\n{'=' * 80}\n".join(
            f"MSG: {nested}\n{text}" if nested != kind else text for nested, text in zip(kinds, texts, strict=True)
        )

    def _value(self, kind: str, value: object, path: str) -> Any:
        if kind in ("float64", "float32"):
            return self._float(value, path)
        if kind in _INTS:
            low, high = _INTS[kind]
            if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
                raise BadMessage(f"{path} needs {kind}")
            return value
        if kind == "bool" or kind == "string":
            if not isinstance(value, bool if kind == "bool" else str):
                raise BadMessage(f"{path} needs a {kind}")
            return value
        if kind in ("time", "duration"):
            return self._time(value, path)
        if kind.endswith("]"):
            return self._list(kind, value, path)
        return self._object(kind, value, path)

    def _float(self, value: object, path: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise BadMessage(f"{path} needs a number")
        try:
            return float(value)
        except OverflowError as error:
            raise BadMessage(f"{path} is too large") from error

    def _time(self, value: object, path: str) -> dict[str, int]:
        if value == "now":
            return self.time(self._now())
        if not isinstance(value, dict):
            raise BadMessage(f"{path} needs a time")
        whole, part = ("sec", "nanosec") if self._ros2 else ("secs", "nsecs")
        if path.endswith("header.stamp") and not {whole, part} & value.keys():
            return self.time(self._now())
        return self.time((_whole(value.get(whole, 0), path), _whole(value.get(part, 0), path)))

    def _list(self, kind: str, value: object, path: str) -> list[Any]:
        element, _, length = kind[:-1].partition("[")
        if not isinstance(value, list) or (length and len(value) != int(length)):
            raise BadMessage(f"{path} needs a list{' of ' + length if length else ''}")
        return [self._value(element, item, path) for item in value]

    def _object(self, kind: str, value: object, path: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise BadMessage(f"{path} needs an object")
        fields = self.fields_of(kind)
        unknown = value.keys() - {name for name, _ in fields}
        if unknown:
            raise BadMessage(f"{path} has no field {sorted(map(str, unknown))[0]}")
        filled = {
            name: self._value(field, value[name], f"{path}.{name}") if name in value else self._default(field)
            for name, field in fields
        }
        if kind == "std_msgs/Header" and "stamp" not in value:
            filled["stamp"] = self.time(self._now())
        return filled

    def fields_of(self, kind: str) -> Fields:
        """Return the fields of a message type in its short spelling (`pkg/Type`)."""
        if kind == "std_msgs/Header":
            both = (("stamp", "time"), ("frame_id", "string"))
            return both if self._ros2 else (("seq", "uint32"), *both)
        return DEFINITIONS[kind]

    def _default(self, kind: str) -> Any:
        if kind in ("float64", "float32"):
            return 0.0
        if kind in _INTS:
            return 0
        if kind in ("bool", "string"):
            return False if kind == "bool" else ""
        if kind in ("time", "duration"):
            return self.time((0, 0))
        if kind.endswith("]"):
            element, _, length = kind[:-1].partition("[")
            return [self._default(element) for _ in range(int(length or 0))]
        filled = {name: self._default(field) for name, field in self.fields_of(kind)}
        if kind == "std_msgs/Header" and not self._ros2:
            filled["stamp"] = self.time(self._now())
        return filled


def _whole(value: object, path: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise BadMessage(f"{path} needs a time of ints")
    return value
