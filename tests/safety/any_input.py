"""Ticks whose input is anything at all: which numbers a tick sees, how they may be wrong, and the inputs made so.

Every number of `TickInput` is a place, found from its type, so that a new field is tried as soon as it is there. A
`Change` spoils one place over some ticks. Hypothesis draws changes, and so does `drawn_changes` from a seed, cheaply.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import msgspec
from msgspec.structs import replace

from robot_io.tick import FtReading, TickInput

TICKS = 100
FLOATS = (
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-3, -1e-3, 0.1, -0.1, 0.5, -0.5, 1.0, -1.0, math.pi, 10.0),
    *(-10.0, 50.0, 160.0, -160.0, 300.0, -327.68, 1e6, -1e6, 1e17, 1.7e308, -1.7e308),
)
INTEGERS = (0, 1, -1, 2, 3, 5, 7, 20, 255, 256, 2**31 - 1, 2**31, -(2**31), 2**53, 2**62, -(2**62))
MOST = 2**62
"""More is reached by no counter, and by no clock in nanoseconds in a century."""
MOST_OF = {"uint8": 2**8 - 1, "uint32": 2**32 - 1}
"""What a field of this width holds; no driver or process passes on more."""
OFFSETS_NS = (1, -1, 10**7, -(10**7), -5 * 10**7, -(10**8), -2 * 10**8, -(10**9), 10**9, -(10**10), 10**12)
HOWS = ("value", "value", "frozen", "offset", "scaled")


class Change(NamedTuple):
    """One place spoilt from tick `begin` for `ticks`: `how` one of HOWS, `number` picks the value."""

    place: int
    how: str
    number: int
    begin: int
    ticks: int


class Place(NamedTuple):
    """Where a number of the input is, and its type (float, int or bool)."""

    name: str
    kind: type
    read: Callable[[TickInput], Any]
    put: Callable[[TickInput, Any], TickInput]


OWN = {"tick", "now_ns", "host.skipped", "ft.readings"}
"""Counted by the loop itself (time jumps in `any_run`), or of a length of its own."""


@cache
def places() -> tuple[Place, ...]:
    """Return every number that one tick sees."""
    found = [p for p in _places_in(TickInput, "") if p.name not in OWN]
    return (*found, *(_in_newest_reading(p) for p in _places_in(FtReading, "")))


def _places_in(struct: type[msgspec.Struct], prefix: str) -> list[Place]:
    found: list[Place] = []
    for name, kind in get_type_hints(struct, include_extras=True).items():
        if name.startswith("__") or f"{prefix}{name}" in OWN:
            continue
        inner = _places_of(kind, f"{prefix}{name}")
        found += [_inside(name, place) for place in inner]
    return found


def _places_of(kind: Any, name: str) -> list[Place]:
    """Return the places in a value of a type; `read` and `put` take the value itself."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return _places_in(kind, f"{name}.")
    if get_origin(kind) is tuple and Ellipsis not in get_args(kind):
        return [_element(i, place) for i, one in enumerate(get_args(kind)) for place in _places_of(one, f"{name}[{i}]")]
    if get_origin(kind) is Annotated:
        base, width, *_ = get_args(kind)
        most = MOST_OF[width]
        return [place._replace(put=lambda _, new: min(max(new, 0), most)) for place in _places_of(base, name)]
    if kind in (float, int, bool):
        return [Place(name, kind, lambda value: value, lambda _, new: new)]
    raise TypeError(f"{name}: nothing is known of {kind}")


def _inside(name: str, place: Place) -> Place:
    read, put = place.read, place.put
    return place._replace(
        read=lambda whole: read(getattr(whole, name)),
        put=lambda whole, new: replace(whole, **{name: put(getattr(whole, name), new)}),
    )


def _element(i: int, place: Place) -> Place:
    read, put = place.read, place.put
    return place._replace(
        read=lambda whole: read(whole[i]),
        put=lambda whole, new: (*whole[:i], put(whole[i], new), *whole[i + 1 :]),
    )


def _in_newest_reading(place: Place) -> Place:
    def put(inp: TickInput, new: Any) -> TickInput:
        if not inp.ft.readings:
            return inp
        *older, newest = inp.ft.readings
        return replace(inp, ft=replace(inp.ft, readings=(*older, place.put(newest, new))))

    return Place(
        f"ft.readings[-1].{place.name}",
        place.kind,
        lambda inp: place.read(inp.ft.readings[-1]) if inp.ft.readings else place.kind(),
        put,
    )


def spoilt_value(kind: type, good: Any, frozen: Any, how: str, number: int) -> Any:
    """Return what is seen instead of `good`; `frozen`: what it was when the change began."""
    if kind is bool:
        return bool(number % 2)
    if how == "frozen":
        return frozen
    if kind is float:
        value = FLOATS[number % len(FLOATS)]
        return {"value": value, "offset": good + value, "scaled": good * value}[how]
    if how == "value":
        return INTEGERS[number % len(INTEGERS)]
    wrong = good + OFFSETS_NS[number % len(OFFSETS_NS)] if how == "offset" else good * (number % 5 - 1)
    return min(max(wrong, -MOST), MOST)


def drawn_changes(draw: random.Random) -> list[Change]:
    """Return the changes of one sequence: often few and long, sometimes many and short."""
    wildness = draw.choice((0, 1, 1, 2, 2, 3, 5, 10, 30))
    longest = draw.choice((1, 3, 20, TICKS))
    count = len(places())
    return [
        Change(
            draw.randrange(count),
            draw.choice(HOWS),
            draw.randrange(1000),
            draw.randrange(TICKS),
            draw.randint(1, longest),
        )
        for _ in range(wildness)
    ]


class Spoiler:
    """Applies changes tick by tick, and remembers what froze."""

    def __init__(self, changes: list[Change]) -> None:
        self._changes = changes
        self._frozen: dict[Change, Any] = {}

    def spoil(self, inp: TickInput, n: int) -> TickInput:
        """Return the input of tick `n` with every change that is under way."""
        for change in self._changes:
            if not change.begin <= n < change.begin + change.ticks:
                continue
            place = places()[change.place]
            good = place.read(inp)
            frozen = self._frozen.setdefault(change, good)
            inp = place.put(inp, spoilt_value(place.kind, good, frozen, change.how, change.number))
        return inp
