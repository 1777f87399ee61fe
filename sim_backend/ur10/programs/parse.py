"""URScript as far as it is plain: calls, assignments, `if` and `while`, in one function without threads.

Its expressions are a subset of Python's, so Python's own parser reads them; nothing of them is ever run by Python.
Functions of its own, threads and the like would need an interpreter and are refused. Pure.
"""

from __future__ import annotations

import ast
import re

import msgspec

from sim_backend.ur10.programs.program import ScriptError

_CONDITION = re.compile(r"(if|elif|while)\b\s*(.+?)\s*:$")
_ELSE = re.compile(r"else\s*:$")
_NEEDS_INTERPRETER = re.compile(
    r"(if|elif|else|for|while|def|sec|thread|return|break|continue|run|kill|join|enter_critical|exit_critical|switch"
    r"|case|default)\b"
)
_KEEPS = re.compile(r"^(?:global|local)\s+")
_ALWAYS = ast.Constant(value=True)


class Line(msgspec.Struct, frozen=True):
    """A call or an assignment, or a condition; lines and columns count from 1."""

    number: int
    column: int
    targets: tuple[ast.expr, ...]
    value: ast.expr


class Choice(msgspec.Struct, frozen=True):
    """The first of the branches whose condition holds."""

    branches: tuple[tuple[Line, Body], ...]


class Loop(msgspec.Struct, frozen=True):
    """Statements that are repeated while a condition holds."""

    condition: Line
    body: Body


Body = tuple[Line | Choice | Loop, ...]
Numbered = tuple[int, str]


def parse(text: str) -> Body:
    """Return the statements of a program: its body, where it is `def name():` ... `end`. Raises ScriptError."""
    lines = [(number, line.partition("#")[0].rstrip()) for number, line in enumerate(text.splitlines(), start=1)]
    lines = [(number, line) for number, line in lines if line.strip()]
    if lines and re.match(r"\s*(def|sec)\s", lines[0][1]):
        lines = lines[1:]
        if lines and lines[-1][1].strip() == "end":
            lines = lines[:-1]
    lines.reverse()  # taken from the end, which is cheap
    body = _block(lines)
    if lines:
        raise _syntax_error(*lines[-1])
    return body


def _block(lines: list[Numbered]) -> Body:
    """Take the statements up to what ends their block."""
    body: list[Line | Choice | Loop] = []
    while lines and not _ends_block(lines[-1][1].strip()):
        number, text = lines[-1]
        found = _CONDITION.match(text.strip())
        if found and found.group(1) == "while":
            lines.pop()
            body.append(Loop(_condition(number, text, found.group(2)), _block(lines)))
            _take_end(lines, number, text)
        elif found and found.group(1) == "if":
            body.append(_choice(lines))
        else:
            body.append(_line(number, text))
            lines.pop()
    return tuple(body)


def _choice(lines: list[Numbered]) -> Choice:
    first = lines[-1]
    branches: list[tuple[Line, Body]] = []
    while lines:
        number, text = lines[-1]
        found = _CONDITION.match(text.strip())
        if found and found.group(1) == ("elif" if branches else "if"):
            condition = _condition(number, text, found.group(2))
        elif branches and _ELSE.match(text.strip()):
            condition = Line(number, 1, (), _ALWAYS)
        else:
            break
        lines.pop()
        branches.append((condition, _block(lines)))
    _take_end(lines, *first)
    return Choice(tuple(branches))


def _ends_block(word: str) -> bool:
    return word == "end" or _ELSE.match(word) is not None or word.startswith("elif ")


def _take_end(lines: list[Numbered], number: int, text: str) -> None:
    if not lines or lines.pop()[1].strip() != "end":
        raise _syntax_error(number, text)


def _condition(number: int, text: str, condition: str) -> Line:
    try:
        return Line(number, _column(text), (), ast.parse(condition, mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _syntax_error(number, text) from None


def _line(number: int, text: str) -> Line:
    word = text.strip()
    if found := _NEEDS_INTERPRETER.match(word):
        name = found.group(1)
        raise ScriptError(
            number, _column(text), f"compile_error_not_emulated:{name}:",
            f"`{name}` needs a URScript interpreter, which this emulator has not",
        )  # fmt: skip
    try:
        (statement,) = ast.parse(_KEEPS.sub("", word)).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _syntax_error(number, text) from None
    if isinstance(statement, ast.Expr):
        return Line(number, _column(text), (), statement.value)
    if isinstance(statement, ast.Assign):
        return Line(number, _column(text), tuple(statement.targets), statement.value)
    raise _syntax_error(number, text)


def _column(text: str) -> int:
    return 1 + len(text) - len(text.lstrip())


def _syntax_error(number: int, text: str) -> ScriptError:
    return ScriptError(number, 1, f"syntax_error_on_line:{number}:{text}:", f"no URScript: {text.strip()[:80]!r}")
