"""Tables to typed settings, with every mistake found, not only the first.

msgspec stops at the first mistake of a call; here each value is converted on its own, so that a person sees
all mistakes of a file at once, each with its place and, for an unknown key, the nearest known one.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import msgspec

from robot_io.errors import ConfigError
from robot_io.rig.renames import advice
from robot_io.rig.toml import KeyPath, Origins, origin_of
from robot_io.rig.types import table_of

ALIKE = 0.75
"""How like a key elsewhere has to be (difflib's ratio) to be meant rather than one of the same table."""

T = TypeVar("T", bound=msgspec.Struct)
Origin = Callable[[KeyPath], str]
Mistakes = list[tuple[str, str]]
"""Place and sentence of each."""


def build(kind: type[T], data: Mapping[str, Any], origins: Origins, name: str) -> T:
    """Convert nested tables to `kind`.

    `origins` says where each key was written and `name` is the file's. Raises ConfigError listing every
    unknown key, missing key, wrong type, value out of range and number that is not finite.
    """
    mistakes: Mistakes = []
    reader = _Reader(kind, lambda path: origin_of(path, origins, name), mistakes)
    built = reader.read(kind, data, ())
    if mistakes:
        if len(mistakes) == 1:
            where, what = mistakes[0]
            raise ConfigError(what, where=where)
        listed = "\n".join(f"  {where}: {what}" for where, what in mistakes)
        raise ConfigError(f"{len(mistakes)} mistakes\n{listed}", where=name)
    return msgspec.convert(built, kind)


class _Reader:
    """Reads the tables of `root`, adding what is wrong to `mistakes`."""

    def __init__(self, root: type[msgspec.Struct], origin: Origin, mistakes: Mistakes) -> None:
        self._root, self._origin, self._mistakes = root, origin, mistakes

    def read(self, kind: type[msgspec.Struct], data: Mapping[str, Any], path: KeyPath) -> dict[str, Any]:
        """Return the keys of the table `path` that are right."""
        fields = _fields_of(kind)
        built: dict[str, Any] = {}
        for key, value in data.items():
            here = (*path, key)
            if key not in fields:
                dotted = ".".join(here)
                what = advice(dotted) or f"unknown key `{dotted}`{self._meant(here, value, list(fields))}"
                self._note(here, what)
            elif table := table_of(fields[key].type):
                if isinstance(value, Mapping):
                    built[key] = self.read(table, value, here)
                else:
                    self._note(here, f"`{'.'.join(here)}` is a table, not a value")
            elif problem := _problem(fields[key].type, value):
                self._note(here, f"`{'.'.join(here)}` = {_short(value)}: {problem}")
            else:
                built[key] = value
        for key, field in fields.items():
            if key not in data and field.required:
                self._note(path, f"`{'.'.join((*path, key))}` is missing")
        return built

    def _note(self, path: KeyPath, what: str) -> None:
        self._mistakes.append((self._origin(path), what))

    def _meant(self, path: KeyPath, value: Any, known: list[str]) -> str:
        """Return a hint: the keys that end like the unknown one, which stand in other tables, or else a near name."""
        ending = path
        while isinstance(value, Mapping) and len(value) == 1:
            [(key, value)] = value.items()
            ending = (*ending, key)
        names = list(_names(self._root))
        alike = difflib.get_close_matches(ending[-1], [name[-1] for name in names], n=1, cutoff=ALIKE)
        if difflib.get_close_matches(path[-1], known, n=1, cutoff=ALIKE):
            alike = []
        for end in (*(ending[start:] for start in range(len(ending))), *((word,) for word in alike)):
            found = [f"`{'.'.join(name)}`" for name in names if name[-len(end) :] == end]
            if found:
                return f", did you mean {' or '.join([', '.join(found[:-1]), found[-1]] if found[1:] else found)}?"
        return _nearest(path[-1], known)


@cache
def _fields_of(kind: type[msgspec.Struct]) -> dict[str, msgspec.structs.FieldInfo]:
    """Return the fields of a table by name, looked up once: msgspec reads every annotation anew."""
    return {field.name: field for field in msgspec.structs.fields(kind)}


def _names(kind: type[msgspec.Struct], path: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the path of every value."""
    for field in msgspec.structs.fields(kind):
        here = (*path, field.name)
        if table := table_of(field.type):
            yield from _names(table, here)
        else:
            yield here


def _problem(kind: Any, value: Any) -> str:
    """Return what is wrong with `value` as a `kind`, or an empty string."""
    try:
        converted = msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        if choices := _choices(kind):
            names = f"expected one of {', '.join(map(str, choices))}"
            if get_origin(kind) is Literal:
                return names
            if isinstance(value, str):
                return f"{names}, or a list"
        return str(error).replace("Expected", "expected").replace(" - at `$", " at `")
    except OverflowError:
        return "this number is too large"
    return "" if _finite(converted) else "this number is not finite"


def _choices(kind: Any) -> tuple[Any, ...]:
    if get_origin(kind) in (Union, UnionType):
        return tuple(choice for part in get_args(kind) for choice in _choices(part))
    return get_args(kind) if get_origin(kind) is Literal else ()


def _finite(value: Any) -> bool:
    if isinstance(value, msgspec.Struct):
        value = msgspec.structs.astuple(value)
    if isinstance(value, tuple):
        return all(_finite(item) for item in value)
    return not isinstance(value, float) or math.isfinite(value)


def _nearest(key: str, known: list[str]) -> str:
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f", did you mean `{near[0]}`?" if near else f" (known here: {', '.join(known)})"


def _short(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:  # Python does not write integers of thousands of digits
        text = "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
