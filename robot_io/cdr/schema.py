"""Makes a message type out of the `ros2msg` text in a log, so that any topic can be read, also an older program's.

The text is untrusted: sizes are bounded and a type cannot hold itself. Constants, defaults and bounds are left out.
"""

from __future__ import annotations

import re
from typing import Annotated, Any

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.shape import PRIMITIVES, Nested, shape_of
from robot_io.errors import LogDamaged

_SEPARATOR = re.compile(r"^={3,}[ \t\r]*$", re.MULTILINE)
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>[A-Za-z]\w*)(?:\s+[^=].*)?\Z"
)
_CONSTANT = re.compile(r"\w+(?:<=\d+)?\s+[A-Z]\w*\s*=")
ONLY_FIELD_OF_EMPTY = "structure_needs_at_least_one_member"
"""The one byte that ROS 2 gives an empty message."""
_LEAVES_MAX = 5000
_DEPTH_MAX = 20


def type_from_schema(name: str, text: str) -> CdrType[Any]:
    """Return the type of a message called `name` ("pkg/msg/Name"). Raises LogDamaged when the text cannot be used."""
    shape = shape_from_schema(name, text)
    try:
        return CdrType(shape.struct_type, name)
    except TypeError as error:
        raise _unusable(name, error) from None


def shape_from_schema(name: str, text: str) -> Nested:
    """Return the shape of a message called `name`. Raises LogDamaged when the text cannot be used."""
    try:
        struct_type, _ = _Maker(_definitions(name, text)).make(_short(name), 0)
        shape = shape_of(struct_type)
    except (ValueError, TypeError) as error:
        raise _unusable(name, error) from None
    if not isinstance(shape, Nested):
        raise _unusable(name, "it is not a message")
    return shape


def _unusable(name: str, why: object) -> LogDamaged:
    return LogDamaged(f"the schema of {name[:100]} cannot be read: {why}")


class _Maker:
    """Turns definitions into Structs, each once, and counts what a message would hold."""

    def __init__(self, definitions: dict[str, list[str]]) -> None:
        self._definitions = definitions
        self._made: dict[str, tuple[type[msgspec.Struct], int]] = {}

    def make(self, name: str, depth: int) -> tuple[type[msgspec.Struct], int]:
        if name in self._made:
            return self._made[name]
        if depth > _DEPTH_MAX:
            raise ValueError("its types are nested too deeply")
        if name not in self._definitions:
            raise ValueError(f"{name[:60]} is not defined in it")
        fields: list[tuple[str, Any]] = []
        total = 0
        for line in self._definitions[name]:
            match = _FIELD.match(line)
            if match is None:
                raise ValueError(f"not a field: {line[:60]!r}")
            element, leaves = self._element(match["type"], name.split("/")[0], depth)
            total += leaves
            fields.append((match["name"], _array(element, match["array"])))
        if len({field for field, _ in fields}) != len(fields):
            raise ValueError("two fields have the same name")
        if total > _LEAVES_MAX:
            raise ValueError(f"it has more than {_LEAVES_MAX} fields")
        if not fields:
            fields, total = [(ONLY_FIELD_OF_EMPTY, Annotated[int, "uint8"])], 1
        package, _, short = name.partition("/")
        namespace = {"__ros_name__": f"{package}/msg/{short}"}
        self._made[name] = msgspec.defstruct(short, fields, namespace=namespace, frozen=True, gc=False), total
        return self._made[name]

    def _element(self, type_name: str, package: str, depth: int) -> tuple[Any, int]:
        if type_name in PRIMITIVES:
            base = bool if type_name == "bool" else float if type_name.startswith("float") else int
            return (base if base is bool else Annotated[base, type_name]), 1
        if type_name == "string":
            return str, 1
        if type_name == "wstring":
            return Annotated[str, "wstring"], 1
        nested = _short(type_name) if "/" in type_name else f"{package}/{type_name}"
        return self.make(nested, depth + 1)


def _definitions(name: str, text: str) -> dict[str, list[str]]:
    first, *others = _SEPARATOR.split(text)
    found = {_short(name): _lines(first)}
    for block in others:
        head, *lines = block.strip().split("\n")
        if not head.startswith("MSG: "):
            raise ValueError("a nested type without a name")
        found[_short(head.removeprefix("MSG: ").strip())] = _lines("\n".join(lines))
    return found


def _lines(text: str) -> list[str]:
    lines = (line.partition("#")[0].strip() for line in text.split("\n"))
    return [line for line in lines if line and not _CONSTANT.match(line)]


def _array(element: Any, suffix: str | None) -> Any:
    if suffix is None:
        return element
    length = suffix.strip("[]")
    sequence = tuple[element, ...]
    if not length or length.startswith("<="):
        return sequence
    if int(length) == 0:
        raise ValueError("an array of no elements")
    return Annotated[sequence, int(length)]


def _short(name: str) -> str:
    parts = name.split("/")
    if len(parts) not in (2, 3):
        raise ValueError(f"not a type name: {name[:60]!r}")
    return f"{parts[0]}/{parts[-1]}"
