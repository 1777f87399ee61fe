"""Every error reads the same: "where: what. do", three parts that are put together, so none ends with a full stop."""

import ast
from pathlib import Path

import pytest

from robot_io.errors import PushError

ROOT = Path(__file__).parents[2]
FOLDERS = ("robot_io", "control", "safety", "sim_backend", "tools")
SOURCES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def error_types(kind: type[PushError] = PushError) -> set[str]:
    return {kind.__name__}.union(*(error_types(below) for below in kind.__subclasses__()))


def ends_with_stop(node: ast.expr) -> bool:
    if isinstance(node, ast.JoinedStr):
        node = node.values[-1]
    return isinstance(node, ast.Constant) and str(node.value).endswith(".")


def full_stops(source: str) -> list[int]:
    """Return the lines of the parts of errors that end with one."""
    found = []
    types = error_types()
    for call in ast.walk(ast.parse(source)):
        if isinstance(call, ast.Call):
            made = isinstance(call.func, ast.Name) and call.func.id in types
            parts = call.args if made else []
            parts += [word.value for word in call.keywords if word.arg in ("do", "where")]
            found += [part.lineno for part in parts if ends_with_stop(part)]
    return found


def test_the_parts_are_put_together():
    assert str(PushError("it is away", where="there", do="Bring it back")) == "there: it is away. Bring it back"


@pytest.mark.parametrize("line", ["UsageError('bad.')", "raise kind(a, do='Mend it.')", "DeviceError(f'{x} is bad.')"])
def test_a_full_stop_is_seen(line):
    assert full_stops(line)


def test_no_part_of_an_error_ends_with_a_full_stop():
    found = [f"{path.relative_to(ROOT)}:{line}" for path in SOURCES for line in full_stops(path.read_text("utf-8"))]
    assert not found
