"""What a message type looks like to ROS 2: the shape of its fields and its `ros2msg` text.

A message is a `msgspec.Struct`; its annotations say how each field goes on the wire:

    float -> float64          int, IntEnum -> int64      bool -> bool       str -> string     bytes -> uint8[]
    Annotated[int, "uint8"]   any other width            tuple[X, ...] -> X[]                 Struct -> nested
    tuple[X, X, X] -> X[3]    (all of one type)  Annotated[tuple[X, ...], 36] -> X[36]
    Annotated[int, "uint8", Mode]   stays an int; the definition names its values: uint8 MODE_STOP=5

A Struct with a class variable `__ros_constants__`, lines like "byte OK=0", has them in its definition.
ROS 2 wants field names in lower case: `force_N` is `force_n` there.
A nested type is called `push_msgs/msg/<ClassName>` unless it has a class variable `__ros_name__`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cache
from typing import Annotated, Any, get_args, get_origin

import msgspec

from robot_io.cdr.packer import Construction, Slot, builder_of

# ROS 2 primitive -> (code of the struct module, bytes); sizes and alignment are the same number in CDR.
PRIMITIVES: dict[str, tuple[str, int]] = {
    "bool": ("?", 1),
    "byte": ("B", 1),
    "char": ("B", 1),
    "int8": ("b", 1),
    "uint8": ("B", 1),
    "int16": ("h", 2),
    "uint16": ("H", 2),
    "int32": ("i", 4),
    "uint32": ("I", 4),
    "int64": ("q", 8),
    "uint64": ("Q", 8),
    "float32": ("f", 4),
    "float64": ("d", 8),
}
_FLOATS = ("float32", "float64")
_FIELD_NAME = re.compile(r"(?!.*__)(?!.*_\Z)[a-z][a-z0-9_]*\Z")
_WORD_START = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_SEPARATOR = "=" * 80


@dataclass(frozen=True)
class Scalar:
    """One number: its ROS name, the enum it is turned into when read, and the one whose members name its values."""

    ros: str
    enum: type[Enum] | None = None
    named_by: type[IntEnum] | None = None


@dataclass(frozen=True)
class Text:
    """A string: uint32 length with the closing NUL, UTF-8 bytes, NUL. A wide one, a `wstring`, is only read."""

    wide: bool = False


@dataclass(frozen=True)
class Blob:
    """A `bytes` value, on the wire a uint8[]."""


@dataclass(frozen=True)
class Many:
    """`length` elements in a row, or a uint32 count and then the elements (`length` None)."""

    element: Shape
    length: int | None


@dataclass(frozen=True)
class Nested:
    """A Struct: how to call it, its ROS name, its fields in order, and the lines of constants in its definition."""

    struct_type: Any
    ros_name: str
    fields: tuple[tuple[str, Shape], ...]
    constants: tuple[str, ...] = ()


Shape = Scalar | Text | Blob | Many | Nested


@cache
def shape_of(annotation: Any) -> Shape:
    """Return the shape of a type annotation. Raises TypeError for what ROS 2 cannot carry."""
    if get_origin(annotation) is Annotated:
        base, *notes = get_args(annotation)
        shape = shape_of(base)
        for note in notes:
            if note == "wstring" and isinstance(shape, Text):
                shape = Text(wide=True)
            elif isinstance(note, str):
                shape = _with_width(shape, note, annotation)
            elif isinstance(note, type) and issubclass(note, IntEnum) and isinstance(shape, Scalar):
                shape = Scalar(shape.ros, shape.enum, note)
            elif isinstance(note, int) and isinstance(shape, Many):
                shape = Many(shape.element, note)
        return shape
    if get_origin(annotation) is tuple:
        return _shape_of_tuple(annotation)
    struct_type = get_origin(annotation) or annotation
    if not isinstance(struct_type, type):
        raise TypeError(f"{annotation!r} has no ROS 2 form")
    if issubclass(struct_type, msgspec.Struct):
        return _shape_of_struct(annotation, struct_type)
    if issubclass(struct_type, Enum):
        if not issubclass(struct_type, int):
            raise TypeError(f"{annotation!r}: only enums of int have a ROS 2 form")
        return Scalar("int64", struct_type)
    plain: dict[type, Shape] = {
        bool: Scalar("bool"),
        int: Scalar("int64"),
        float: Scalar("float64"),
        str: Text(),
        bytes: Blob(),
    }
    if struct_type not in plain:
        raise TypeError(f"{annotation!r} has no ROS 2 form")
    return plain[struct_type]


def schema_text(shape: Nested) -> str:
    """Return the `ros2msg` text of a message with the definitions of all nested types behind it."""
    nested: dict[str, Nested] = {}
    _collect(shape, nested)
    blocks = [_definition(shape)]
    for name, part in nested.items():
        blocks.append(f"{_SEPARATOR}\nMSG: {_short(name)}\n{_definition(part)}")
    return "".join(blocks)


def leaves(shape: Nested, prefix: str = "") -> Iterator[tuple[str, Shape]]:
    """Yield the dotted path and shape of every field that is not itself a Struct, in wire order."""
    for name, field in shape.fields:
        if isinstance(field, Nested):
            yield from leaves(field, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def builder(shape: Nested) -> Callable[[list[Any]], Any]:
    """Return the function that makes the Struct from its values, in wire order: fixed arrays of numbers are flat."""
    return builder_of(_construction(shape))


def _construction(shape: Nested) -> Construction:
    if tuple(name for name, _ in shape.fields) != _positional(shape.struct_type):
        raise TypeError(f"{shape.ros_name}: fields must be positional, in order")
    children: list[Construction | Slot] = []
    for _, field in shape.fields:
        match field:
            case Nested():
                children.append(_construction(field))
            case Scalar(_, enum):
                children.append(Slot(None, enum))
            case Many(Scalar(_, enum), int() as length):
                children.append(Slot(length, enum))
            case _:
                children.append(Slot())
    return Construction(shape.struct_type, children)


def _positional(struct_type: Any) -> tuple[str, ...]:
    origin = getattr(struct_type, "__origin__", struct_type)
    fields: tuple[str, ...] = origin.__struct_fields__
    return fields


def _with_width(shape: Shape, note: str, annotation: Any) -> Shape:
    if not isinstance(shape, Scalar) or note not in PRIMITIVES:
        raise TypeError(f"{annotation!r}: {note!r} is not a ROS 2 number type")
    if (shape.ros in _FLOATS) != (note in _FLOATS) or "bool" in (shape.ros, note):
        raise TypeError(f"{annotation!r}: a {shape.ros} cannot be sent as {note}")
    return Scalar(note, shape.enum, shape.named_by)


def _shape_of_tuple(annotation: Any) -> Shape:
    items = get_args(annotation)
    if len(items) == 2 and items[1] is Ellipsis:
        element, length = shape_of(items[0]), None
    else:
        shapes = {shape_of(item) for item in items}
        if len(shapes) != 1:
            raise TypeError(f"{annotation!r}: a fixed tuple needs one element type and at least one element")
        element, length = shapes.pop(), len(items)
    if isinstance(element, Many | Blob):
        raise TypeError(f"{annotation!r}: ROS 2 has no arrays of arrays")
    return Many(element, length)


def _shape_of_struct(annotation: Any, struct_type: type[msgspec.Struct]) -> Nested:
    fields = []
    if struct_type.__struct_config__.tag is not None:
        raise TypeError(f"{annotation!r}: tagged types have no ROS 2 form")
    for field in msgspec.structs.fields(annotation):
        if not _FIELD_NAME.match(_ros_field(field.name)):
            raise TypeError(f"{struct_type.__name__}.{field.name} is not a ROS 2 field name")
        try:
            fields.append((field.name, shape_of(field.type)))
        except TypeError as error:
            raise TypeError(f"{struct_type.__name__}.{field.name}: {error}") from None
    if not fields:
        raise TypeError(f"{annotation!r} has no fields")
    arguments = "".join(part.__name__ for part in get_args(annotation))
    default = f"push_msgs/msg/{struct_type.__name__}{arguments}"
    constants = (*getattr(struct_type, "__ros_constants__", ()), *_names_of_values(fields))
    return Nested(annotation, getattr(struct_type, "__ros_name__", default), tuple(fields), constants)


def _names_of_values(fields: list[tuple[str, Shape]]) -> tuple[str, ...]:
    """Return a line for each member of the enums that name values of these fields: "uint8 LINK_STATE_UP=2"."""
    lines = dict[str, None]()
    for _, shape in fields:
        if isinstance(shape, Scalar) and shape.named_by is not None:
            prefix = _WORD_START.sub("_", shape.named_by.__name__).upper()
            lines.update(dict.fromkeys(f"{shape.ros} {prefix}_{one.name}={one.value}" for one in shape.named_by))
    return tuple(lines)


def _collect(shape: Shape, into: dict[str, Nested]) -> None:
    if isinstance(shape, Many):
        _collect(shape.element, into)
        return
    if not isinstance(shape, Nested):
        return
    for _, field in shape.fields:
        inner = field.element if isinstance(field, Many) else field
        if isinstance(inner, Nested):
            if into.setdefault(inner.ros_name, inner).fields != inner.fields:
                raise TypeError(f"two different types are called {inner.ros_name}")
            _collect(inner, into)


def _definition(shape: Nested) -> str:
    names = [_ros_field(name) for name, _ in shape.fields]
    if len(set(names)) != len(names):
        raise TypeError(f"two fields of {shape.ros_name} have the same ROS name")
    constants = "".join(f"{line}\n" for line in shape.constants)
    fields = (f"{_type_name(field)} {name}\n" for name, (_, field) in zip(names, shape.fields, strict=True))
    return constants + "".join(fields)


def _type_name(shape: Shape) -> str:
    match shape:
        case Scalar(ros):
            return ros
        case Text(wide):
            return "wstring" if wide else "string"
        case Blob():
            return "uint8[]"
        case Many(element, length):
            return f"{_type_name(element)}[{'' if length is None else length}]"
        case Nested(_, name):
            return _short(name)


def _ros_field(name: str) -> str:
    return name.lower()


def _short(ros_name: str) -> str:
    package, name = ros_name.split("/msg/")
    return f"{package}/{name}"
