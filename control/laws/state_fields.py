"""The state of a law as plain numbers, which is how a tick keeps and logs it, and back."""

from __future__ import annotations

from typing import Any, get_args, get_origin

import msgspec
from msgspec.structs import astuple

GREATEST_INT = 2**53
"""Every whole number up to this one is exact as a float64."""
_NUMBERS = (float, int, bool)


class _Field(msgspec.Struct, frozen=True):
    name: str
    kinds: tuple[type, ...]
    """Of each element; one of a field that is no tuple."""
    is_tuple: bool


class StateFields:
    """Packs and unpacks states of one class. Raises TypeError for a class with any other field than numbers."""

    def __init__(self, kind: type[Any]) -> None:
        self._kind = kind
        self._fields = tuple(_field(info.name, info.type) for info in msgspec.structs.fields(kind))
        self._empty = None if self._fields else kind()

    @property
    def names(self) -> tuple[str, ...]:
        """The name of each number: `integral_rad`, `last[0]`."""
        return tuple(
            f"{field.name}[{i}]" if field.is_tuple else field.name
            for field in self._fields
            for i in range(len(field.kinds))
        )

    def pack(self, state: Any) -> tuple[float, ...]:
        """Return a state as numbers. Raises TypeError unless it is one of this class, with what its fields say."""
        if type(state) is not self._kind:
            raise TypeError(f"its state is {_a(state)}, not {self._kind.__name__}")
        if self._empty is not None:
            return ()
        packed: list[float] = []
        for field, value in zip(self._fields, astuple(state), strict=True):
            items = value if field.is_tuple else (value,)
            if type(items) is not tuple or len(items) != len(field.kinds):
                raise TypeError(f"`{field.name}` of its state is {_a(value)}, not a tuple of {len(field.kinds)}")
            for item, kind in zip(items, field.kinds, strict=True):
                packed.append(item if type(item) is float and kind is float else _number(item, kind, field.name))
        return tuple(packed)

    def unpack(self, packed: tuple[float, ...]) -> Any:
        """Return the state of numbers that `pack` gave. Raises TypeError if there are more or fewer."""
        if self._empty is not None and not packed:
            return self._empty
        count = sum(len(field.kinds) for field in self._fields)
        if len(packed) != count:
            raise TypeError(f"its state is {len(packed)} numbers, not {count}")
        values: list[Any] = []
        at = 0
        for field in self._fields:
            items = tuple(kind(packed[at + i]) for i, kind in enumerate(field.kinds))
            values.append(items if field.is_tuple else items[0])
            at += len(items)
        return self._kind(*values)


def _field(name: str, kind: Any) -> _Field:
    kinds = get_args(kind) if get_origin(kind) is tuple else (kind,)
    if not all(one in _NUMBERS for one in kinds):
        raise TypeError(f"`{name}` of its State is neither float, int, bool nor a tuple of a fixed number of them")
    return _Field(name, kinds, get_origin(kind) is tuple)


def _number(item: Any, kind: type, name: str) -> float:
    fits = isinstance(item, kind) or (kind is float and isinstance(item, int))
    if not fits or isinstance(item, bool) != (kind is bool) or (kind is int and abs(item) > GREATEST_INT):
        raise TypeError(f"`{name}` of its state is {_a(item)}, not {kind.__name__}")
    return float(item)


def _a(value: Any) -> str:
    return f"a {type(value).__name__}"
