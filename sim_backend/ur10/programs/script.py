"""A straight URScript program: its statements one after the other, a control cycle at a time."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from sim_backend.ur10.programs.expressions import CONSTANTS, Function, Names, check_names, evaluate
from sim_backend.ur10.programs.functions import NAMES, Functions, Halted
from sim_backend.ur10.programs.parse import Body, Choice, Line, Loop, parse
from sim_backend.ur10.programs.program import Robot, ScriptError

STATEMENTS_A_CYCLE = 1000
"""A loop that does more without waiting holds up the controller, which ends the program for it."""
_SETTABLE = {"digital_out": "set_digital_out", "analog_out": "set_analog_out"}
"""Lists of old programs whose items are outputs."""


class Script:
    """A program that was uploaded. Raises ScriptError for what is no straight URScript, or names what is not there."""

    def __init__(self, name: str, text: str, extra: frozenset[str] = frozenset()) -> None:
        self.name = name
        self.progress = 0
        """What the program last gave to `signal_async_progress`, where it has that."""
        self._busy = 0
        self._extra = extra
        self._body = parse(text)
        self._functions: Functions | None = None
        self._steps: Iterator[None] | None = None
        self._check(self._body, set(CONSTANTS) | set(_SETTABLE))

    def step(self, robot: Robot, now_ns: int) -> bool:
        """See `Program.step`."""
        if self._functions is None or self._steps is None:
            self._functions = Functions(robot)
            self._functions.table |= self._extras()
            self._steps = self._run(self._body, Names(self._functions.table))
        self._functions.now_ns = now_ns
        try:
            next(self._steps)
        except (StopIteration, Halted):
            return False
        return True

    def _extras(self) -> dict[str, Function]:
        return dict.fromkeys(self._extra, self._signal)

    def _signal(self, progress: float) -> None:
        self.progress = int(progress)

    def _check(self, body: Body, known: set[str]) -> None:
        for statement in body:
            match statement:
                case Line():
                    self._check_line(statement, known)
                case Loop(condition=condition, body=inner):
                    self._check_line(condition, known)
                    self._check(inner, known)
                case Choice(branches=branches):
                    for condition, inner in branches:
                        self._check_line(condition, known)
                        self._check(inner, known)

    def _check_line(self, line: Line, known: set[str]) -> None:
        where = (line.number, line.column)
        check_names(line.value, known, NAMES | self._extra, where)
        for target in line.targets:
            if isinstance(target, ast.Name):
                known.add(target.id)
            elif not _is_output(target):
                raise ScriptError(*where, "compile_error_not_emulated:assignment:", "an assignment to a part")

    def _run(self, body: Body, names: Names) -> Iterator[None]:
        for statement in body:
            match statement:
                case Line():
                    yield from self._do(statement, names)
                case Loop(condition=condition, body=inner):
                    while self._value(condition, names):
                        yield from self._run(inner, names)
                case Choice(branches=branches):
                    for condition, inner in branches:
                        if self._value(condition, names):
                            yield from self._run(inner, names)
                            break

    def _do(self, line: Line, names: Names) -> Iterator[None]:
        value = self._value(line, names)
        functions = self._functions
        if callable(value) and functions is not None:
            while value(functions.now_ns):
                self._busy = 0
                yield

    def _value(self, line: Line, names: Names) -> object:
        self._busy += 1
        if self._busy > STATEMENTS_A_CYCLE:
            words = "it does not wait anywhere (`sync()`, `sleep`), so it never lets go"
            raise ScriptError(line.number, line.column, "Runtime is too much behind", words)
        try:
            value = evaluate(line.value, names)
            for target in line.targets:
                if isinstance(target, ast.Name):
                    names.variables[target.id] = value
                elif isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name):
                    names.functions[_SETTABLE[target.value.id]](evaluate(target.slice, names), value)
        except (TypeError, ValueError, ZeroDivisionError, IndexError, KeyError, OverflowError) as error:
            raise ScriptError(line.number, line.column, f"Type error: {error}", str(error)) from None
        return value


def _is_output(target: ast.expr) -> bool:
    return isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name) and target.value.id in _SETTABLE
