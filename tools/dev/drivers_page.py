"""Write docs/drivers.md, the API reference of the library, from its docstrings and the examples in the README.

python -m tools.dev.drivers_page > docs/drivers.md
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from tools.dev.api_markdown import entry, prose

README = Path(__file__).resolve().parents[2] / "README.md"

INTRO = """# The drivers as a library

`robot_io` is usable on its own, in your own environment; the program `push` runs only from a checkout.

    pip install path/to/checkout                     # robot_io and its dependencies; no control or tools
    pip install git+ssh://git.example.org/push.git    # the same from your git repository

It is typed (`py.typed`), and importing it loads neither numpy nor a device: each driver is loaded when it is
first used.

## What holds for every driver

- **Order.** `open` identifies the device and `start` begins the data flow; `with` does both, and calls `stop` and
  `close` at the end. `stop` and `close` may be called repeatedly and never raise. A closed driver can be opened again.
- **Timing.** Only `open`, `start`, `stop` and `close` (and the sensor's `probe`) block, each for the time its
  description gives. `drain`, `command` and `health` return at once. Drain at least every 20 ms (`select` on the driver
  if it has a `fileno`); when a driver's bounded buffer is full, the oldest data is dropped and counted.
- **Threads.** A driver starts no threads and takes no locks: use it from the thread that opened it. The UR10's
  connection lives in a child process, which dies with that thread.
- **Units and frames.** SI: N, N\\*m, m, rad, s; the unit is part of the name where it could be in doubt. Frames:
  [frames and signs](frames-and-signs.md). `received_ns` is CLOCK_MONOTONIC (`time.monotonic_ns`).
- **Errors.** `open` and `start` raise errors of [one tree](#errors), each with `what`, `where` and `do`. A link that is
  lost later raises nothing: `drain` returns nothing more, `health` reports `LOST` and why. A driver never reconnects by
  itself: open it again.
- **Emulators.** No device? `push emulate ft300`, `ur` or `ridgeback` in a checkout serves the real protocol to
  any client.
"""


class Part(NamedTuple):
    """A section of the page: public names of one module."""

    title: str
    module: str
    names: tuple[str, ...]
    text_of: str = ""
    """Module whose docstring, without its first line, introduces the section."""
    example: str = ""
    """Class that identifies the README's example."""
    more: str = ""


PARTS = (
    Part("Force-torque sensor", "robot_io.ft300", ("Ft300", "Ft300Reading"), "robot_io.ft300.driver", "Ft300"),
    Part("Held arm", "robot_io.ur10", ("Ur10",), "robot_io.ur10.driver", "Ur10"),
    Part("Force sensor of the arm", "robot_io.ur10", ("UrToolForce",), "robot_io.ur10.tool_force"),
    Part("Mobile base", "robot_io.ridgeback", ("Ridgeback",), "robot_io.ridgeback.driver", "Ridgeback"),
    Part(
        "Devices by kind",
        "robot_io.kinds",
        ("open_device", "build_driver", "find_kind"),
        more="A rig names each device by its kind: a shipped name or your own class ([how](add-a-device.md)).\n"
        "`open_device` and the three drivers are also available in `robot_io` itself.",
    ),
    Part(
        "The contract of a driver",
        "robot_io.driver",
        ("Driver", "Sensor", "Base", "SharedBase", "SensorFacts", "DriverBase", "no_more_options"),
        "robot_io.driver",
    ),
    Part(
        "Messages",
        "robot_io.messages",
        (
            *("Stamped", "SensorWrench", "JointState", "Joints", "ArmState", "ArmRecord", "ArmError"),
            *("BaseFeed", "BasePose", "BaseOdometry", "OdometryPose", "BaseReport", "BaseStatus"),
            *("SliderPose", "CommandEcho", "ClockOffset"),
            *("BaseRecord", "BodyTwist", "WorldTwist", "Pose2D", "DeviceInfo", "DeviceHealth", "LinkState"),
        ),
        "robot_io.messages",
    ),
    Part(
        "Rig files",
        "robot_io.rig",
        ("load_rig", "shipped_rigs", "rig_to_toml", "rig_from_toml", "RigConfig", "TopicsConfig"),
        more="Every setting with its range and default: [rig files](rig-files.md).",
    ),
    Part(
        "Logs",
        "robot_io.log",
        ("CHANNELS", "Kind", "recover"),
        more="What is in a log: [logs](logs.md).",
    ),
    Part("MCAP files", "robot_io.mcap", ("read_log", "read_summary", "LogMessage", "LogSummary", "McapLog")),
    Part("ROS 2 messages as bytes", "robot_io.cdr", ("CdrType", "type_from_schema"), "robot_io.cdr.cdr_type"),
    Part("Time", "robot_io.clock", ("monotonic_ns", "VirtualClock"), "robot_io.clock"),
    Part("Errors", "robot_io.errors", ("PushError",), "robot_io.errors"),
)


def page() -> str:
    """Return the page."""
    linked = {name for part in PARTS for name in part.names}
    contents = " · ".join(f"[{part.title}](#{part.title.lower().replace(' ', '-')})" for part in PARTS)
    parts = [INTRO, f"Sections of this page: {contents}.\n"]
    for part in PARTS:
        members = ", ".join(f"[{name}](#{name.lower()})" for name in part.names)
        parts.append(f"## {part.title}\n\nIn `{part.module}`: {members}.\n")
        parts += [f"{part.more}\n"] if part.more else []
        parts += [_example(part.example)] if part.example else []
        parts += [_introduction(part.text_of)] if part.text_of else []
        module = importlib.import_module(part.module)
        parts += [entry(name, _home(module, name), linked) for name in part.names]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).rstrip() + "\n"


def _home(package: ModuleType, name: str) -> ModuleType:
    """Return the module that defines a name a package exports, found in the imports for the type checker."""
    for node in ast.walk(ast.parse(inspect.getsource(package))):
        if isinstance(node, ast.ImportFrom) and name in (found.name for found in node.names):
            return importlib.import_module(str(node.module))
    return package


def _example(name: str) -> str:
    blocks = re.findall(r"```python\n.*?```\n", README.read_text(encoding="utf-8"), re.S)
    [found] = [block for block in blocks if f" {name}(" in block]
    return str(found)


def _introduction(module: str) -> str:
    """Return a module's docstring as Markdown without its first line, which repeats the title."""
    doc = inspect.getdoc(importlib.import_module(module)) or ""
    return prose(doc.partition("\n")[2])


if __name__ == "__main__":
    sys.stdout.write(page())
