"""Define what is mutated and which tests must notice: the one table to update when files move."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[3]


class Shell(NamedTuple):
    """A module that lives in a process, and the test files that run it, fastest first."""

    path: str
    tests: tuple[str, ...]


WHOLE = (
    "control/*.py",
    "control/laws/*.py",
    "control/notes/*.py",
    "control/pace/*.py",
    "safety/*.py",
    "safety/checks/*.py",
    "robot_io/geometry.py",
    "robot_io/cdr/*.py",
    "robot_io/ft300/codec.py",
    "robot_io/ft300/modbus.py",
    "robot_io/ipc/gate_frame.py",
    "robot_io/log/chain.py",
    "robot_io/log/format_1.py",
    "robot_io/mcap/walk.py",
    "robot_io/log/ros_messages.py",
    "robot_io/log/seal.py",
    "robot_io/ridgeback/rosbridge_codec.py",
    "robot_io/ridgeback/rosbridge_messages.py",
    "robot_io/ur10/generation.py",
    "robot_io/ur10/state.py",
    "robot_io/ur10/tool_packets.py",
)
"""Globs of the parts without a process: every mutant of them is tested, except for the shells below."""

WHOLE_TESTS = ("tests/control", "tests/safety", "tests/robot_io", "tests/tools/log", "tests/wire")
"""Measured once, so that a mutant is only run against the tests that reach it."""

_RUNS = ("tests/tools/commands/test_run_emulated.py",)
SHELLS = (
    Shell("safety/gate_process.py", ("tests/safety/test_gate_process.py", *_RUNS, "tests/faults/test_kills.py")),
    Shell("control/loop.py", ("tests/control/test_loop.py", "tests/tools/run/test_lockstep.py", *_RUNS)),
    Shell("tools/run/control_process.py", (*_RUNS, "tests/faults/test_kills.py")),
    Shell("tools/run/launcher.py", (*_RUNS, "tests/faults/test_kills.py")),
    Shell("tools/run/recorder.py", ("tests/tools/run/test_recorder.py", *_RUNS)),
    Shell(
        "robot_io/ur10/child.py", ("tests/robot_io/ur10/test_ur10_servo.py", "tests/robot_io/ur10/test_ur10_driver.py")
    ),
    Shell("tools/run/arm_process.py", ("tests/tools/run/test_own_kinds.py",)),
    Shell("tools/run/emulator_process.py", _RUNS),
)
SAMPLE = 200
"""This many mutants of all shells together: each needs complete test files that start processes."""
SEED = "single-point-push"

PRODUCT = ("robot_io", "control", "safety", "sim_backend", "tools")


def whole_paths(root: Path = ROOT) -> list[str]:
    """Return the paths of all parts that are mutated completely, relative to `root`, sorted."""
    shells = {shell.path for shell in SHELLS}
    found = {path.relative_to(root).as_posix() for glob in WHOLE for path in root.glob(glob)}
    return sorted(found - shells)
