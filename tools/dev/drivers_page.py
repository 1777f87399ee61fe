"""Writes docs/drivers.md, the API of the library, from its docstrings.

python -m tools.dev.drivers_page > docs/drivers.md
"""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

import robot_io.log as log
from robot_io import Ft300, Ridgeback, Ur10, cdr, clock, driver, errors, messages, open_device, rig
from robot_io.ft300.driver import Ft300Reading
from tools.dev.notes import notes_of

INTRO = """# The drivers as a library

`robot_io` is usable on its own, in your own environment; the program `push` runs from a checkout only.

    pip install path/to/checkout            # robot_io and what it imports; nothing named control or tools

```python
from robot_io import Ft300

with Ft300("/dev/ttyUSB0") as sensor:
    for sample in sensor.drain():
        print(sample.received_ns, sample.value.fz)
```

What holds for every driver:

- **Order.** `open` identifies the device and `start` begins the flow; `with` does both, and `stop` and `close` at the
  end. `stop` and `close` are idempotent and never raise. A closed driver can be opened again.
- **Timing.** Only `open`, `start` and `stop` wait, each for a time that its text names. `drain`, `command` and
  `health` return at once. Drain at least every 20 ms (`select` on `fileno()` where there is one); what does not fit
  into the driver's bounded buffers is dropped, oldest first, and counted.
- **Threads.** A driver belongs to the thread that opened it and starts none of its own. The UR10's connection lives
  in a child process, which dies with the thread that opened it.
- **Units.** SI: N, N\\*m, m, rad, s. `received_ns` is CLOCK_MONOTONIC (`time.monotonic_ns`).
- **Errors.** `open` and `start` raise errors of one tree (below), each with `what`, `where` and `do`. A link that is
  lost later raises nothing: `drain` returns nothing more, `health` says `LOST` and why. A driver never comes back by
  itself.
- **Emulators.** `push emulate ft300`, `ur10` or `ridgeback` in a checkout serves the real bytes to any client.
"""

# fmt: off
PARTS: list[tuple[str, list[Any]]] = [
    ("Drivers", [Ft300, Ft300Reading, Ur10, Ridgeback, open_device]),
    (
        "Writing a driver",
        [driver.SensorFacts, driver.Driver, driver.Sensor, driver.Base, driver.DriverBase, driver.no_more_options],
    ),
    (
        "Messages",
        [
            messages.Stamped, messages.SensorWrench, messages.JointState, messages.ArmState, messages.ArmRecord,
            messages.ArmError, messages.BasePose, messages.BaseOdometry, messages.BaseReport, messages.SliderPose,
            messages.CommandEcho, messages.BaseStatus, messages.Pose2D, messages.BodyTwist, messages.WorldTwist,
            messages.LinkState, messages.DeviceInfo, messages.DeviceHealth,
        ],
    ),
    ("Time", [clock.monotonic_ns, clock.VirtualClock]),
    ("Rig files", [rig.load_rig, rig.rig_to_toml, rig.rig_from_toml, rig.shipped_rigs]),
    ("Logs", [log.read_log, log.read_summary, log.LogMessage, log.LogSummary, log.recover]),
    ("ROS 2 messages as bytes", [cdr.CdrType, cdr.type_from_schema]),
]
# fmt: on


def page() -> str:
    """Return the page."""
    parts = [INTRO]
    for title, members in PARTS:
        parts.append(f"\n## {title}\n")
        parts += [_entry(member) for member in members]
    tree = inspect.cleandoc(errors.__doc__ or "")
    parts.append(f"\n## Errors\n\n`robot_io.errors`: {tree}\n")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).rstrip() + "\n"


def _entry(member: Any) -> str:
    if not inspect.isclass(member):
        return f"### {_heading(member, member.__name__)}\n\n{_text(member)}\n"
    lines = [f"### {_heading(member, member.__name__)}\n\n{_text(member)}\n"]
    notes = _notes(member)
    if issubclass(member, enum.Enum):
        lines += [f"- `{item.name}` = {item.value}{_said(notes.get(item.name))}" for item in member]
    elif issubclass(member, msgspec.Struct):
        lines += _fields([field.name for field in msgspec.structs.fields(member)], notes)
    elif _is_protocol(member):
        lines += _fields([name for name in member.__annotations__ if not name.startswith("_")], notes)
    lines += [
        f"- **`{name}{_signature(method)}`**: {textwrap.indent(_text(method), '  ').strip()}"
        for name, method in _methods(member)
    ]
    return "\n".join(lines) + "\n"


def _fields(names: list[str], notes: dict[str, str]) -> list[str]:
    """Return a line for each field that needs a word, or one line for all."""
    if not any(name in notes for name in names):
        return [f"Fields: {', '.join(f'`{name}`' for name in names)}."] if names else []
    return [f"- `{name}`{_said(notes.get(name))}" for name in names]


def _methods(member: type[Any]) -> Iterator[tuple[str, Callable[..., Any]]]:
    for name, found in vars(member).items():
        method = found.__func__ if isinstance(found, classmethod | staticmethod) else found
        if name.startswith("_") or not inspect.isfunction(method) or not method.__doc__:
            continue
        yield name, method


def _heading(member: Any, name: str) -> str:
    where = member.__module__.removesuffix(".driver") if name in ("Ft300", "Ur10", "Ridgeback") else member.__module__
    if inspect.isclass(member) and (issubclass(member, enum.Enum | msgspec.Struct) or _is_protocol(member)):
        return f"`{where}.{name}`"
    return f"`{where}.{name}{_signature(member)}`"


def _is_protocol(member: type[Any]) -> bool:
    return bool(getattr(member, "_is_protocol", False)) or dataclasses.is_dataclass(member)


def _signature(member: Any) -> str:
    """Return the parameters with their defaults, without self and without types (the text says the units)."""
    shown = []
    starred = False
    for name, parameter in inspect.signature(member).parameters.items():
        if name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            starred = True
            shown.append("*")
        default = "" if parameter.default is parameter.empty else f"={_value(parameter.default)}"
        shown.append(name + default)
    return f"({', '.join(shown)})"


def _value(default: Any) -> str:
    if inspect.isfunction(default):
        return default.__name__
    return f"{type(default).__name__}()" if isinstance(default, msgspec.Struct) else repr(default)


def _text(member: Any) -> str:
    return inspect.cleandoc(member.__doc__ or "")


def _notes(member: type[Any]) -> dict[str, str]:
    """Return the text below each field or enum's member of a class."""
    found = notes_of(sys.modules[member.__module__])
    return {field: text for (name, field), text in found.items() if name == member.__name__}


def _said(note: str | None) -> str:
    return f": {note}" if note else ""


if __name__ == "__main__":
    sys.stdout.write(page())
