"""Laws, checks, supervisor, envelope and gate are pure: nothing in them reads a clock, a file, a socket or a die.

The import contracts forbid the modules; this looks at the source itself, so that no function of the language's
own (open, input, print) and no import hidden in a function gets by, and so that a file added later is seen.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
IMPURE_ROOMS = {"control/loop.py", "safety/gate_process.py"}
PURE = sorted(
    p.relative_to(ROOT).as_posix()
    for folder in ("control", "safety")
    for p in (ROOT / folder).rglob("*.py")
    if p.relative_to(ROOT).as_posix() not in IMPURE_ROOMS
)
ALLOWED = {"__future__", "math", "enum", "msgspec", "typing", "collections"}
OURS = {"control", "safety", "robot_io"}
FORBIDDEN_CALLS = {"open", "print", "input", "exec", "eval", "__import__", "globals", "setattr", "id", "hash"}
"""hash and id differ from run to run; the rest reach out of the function."""
PURE_IN_ROBOT_IO = {
    "messages",
    "named_values",
    "tick",
    "geometry",
    "polygon",
    "errors",
    "rig.config",
    "rig.types",
    "ipc.gate_frame",
}


def offences(source: str) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
            if node.level:
                found.append(f"{node.lineno}: relative import")
        for name in names:
            top, _, rest = name.partition(".")
            if top not in ALLOWED | OURS or (top == "robot_io" and rest not in PURE_IN_ROBOT_IO):
                found.append(f"{node.lineno}: import {name}")
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FORBIDDEN_CALLS:
            found.append(f"{node.lineno}: {node.func.id}()")
        if isinstance(node, ast.Global | ast.Nonlocal):
            found.append(f"{node.lineno}: {', '.join(node.names)} from outside")
    return found


@pytest.mark.parametrize("path", PURE)
def test_pure_rooms_reach_for_nothing(path):
    assert offences((ROOT / path).read_text(encoding="utf-8")) == []


def test_there_are_pure_rooms_and_the_impure_ones_are_where_they_were():
    assert len(PURE) > 20
    for room in IMPURE_ROOMS:
        assert offences((ROOT / room).read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "line",
    [
        "import time",
        "from os import environ",
        "import random",
        "import socket",
        "import threading",
        "import numpy as np",
        "from robot_io.clock import monotonic_ns",
        "def f():\n    import time",
        "open('x')",
        "hash('x')",
        "def f():\n    global x",
    ],
)
def test_an_offence_is_seen(line):
    assert offences(line)
