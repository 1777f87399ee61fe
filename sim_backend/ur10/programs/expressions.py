"""Values of URScript expressions: numbers, lists, poses p[...], strings, variables, arithmetic and calls. Pure."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping, Set
from typing import Any

from sim_backend.ur10.motion.transforms import Pose6
from sim_backend.ur10.programs.program import ScriptError


class Pose(tuple[float, ...]):
    """A pose p[x, y, z, rx, ry, rz], which URScript tells from a list of joints."""

    @property
    def six(self) -> Pose6:
        """Return it as six numbers."""
        a, b, c, d, e, f = self
        return (a, b, c, d, e, f)


Function = Callable[..., object]

CONSTANTS: dict[str, object] = {"True": True, "False": False}
_OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


class Names:
    """What a program's expressions can name: its variables, and the functions of the controller."""

    def __init__(self, functions: Mapping[str, Function]) -> None:
        self.variables: dict[str, object] = {}
        self.functions = functions


def check_names(node: ast.expr, known: set[str], functions: Set[str], where: tuple[int, int]) -> None:
    """Refuse an expression that names what is not there. Raises ScriptError."""
    for part in ast.walk(node):
        if isinstance(part, ast.Call) and isinstance(part.func, ast.Name):
            if part.func.id not in functions:
                raise _not_found(part.func.id, where)
        elif isinstance(part, ast.Name) and part.id not in known and part.id not in functions and part.id != "p":
            raise _not_found(part.id, where)


def evaluate(node: ast.expr, names: Names) -> object:
    """Return the value of an expression. Raises ValueError, TypeError, ZeroDivisionError for what has none."""
    match node:
        case ast.Constant(value=bool() | int() | float() | str() as value):
            return value
        case ast.List(elts=parts):
            return [evaluate(part, names) for part in parts]
        case ast.Tuple(elts=parts):  # a list in round brackets, as old clients send
            return [evaluate(part, names) for part in parts]
        case ast.Name(id=name):
            return names.variables[name]
        case ast.Subscript(value=ast.Name(id="p"), slice=ast.Tuple(elts=parts)) if len(parts) == 6:
            return Pose(number(evaluate(part, names)) for part in parts)
        case ast.Subscript(value=value, slice=index):
            return _item(evaluate(value, names), evaluate(index, names))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -number(evaluate(operand, names))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not evaluate(operand, names)
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
            return _COMPARISONS[type(op)](evaluate(left, names), evaluate(right, names))
        case ast.BoolOp(op=op, values=parts):
            decides = isinstance(op, ast.Or)
            return decides if any(bool(evaluate(part, names)) == decides for part in parts) else not decides
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](number(evaluate(left, names)), number(evaluate(right, names)))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=keywords):
            given = [evaluate(argument, names) for argument in arguments]
            named = {keyword.arg or "": evaluate(keyword.value, names) for keyword in keywords}
            return names.functions[name](*given, **named)
    raise TypeError("an expression that needs a URScript interpreter")


def number(value: object) -> float:
    """Return a number. Raises TypeError for anything else; a truth value is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"a number is wanted, not {value!r}")
    return value


def six(value: object) -> Pose6:
    """Return six numbers of a list or pose. Raises TypeError."""
    if not isinstance(value, list | Pose) or len(value) != 6:
        raise TypeError(f"six numbers are wanted, not {value!r}")
    a, b, c, d, e, f = map(number, value)
    return (a, b, c, d, e, f)


def _item(value: object, index: object) -> object:
    if not isinstance(value, list | Pose) or not isinstance(index, int) or not 0 <= index < len(value):
        raise TypeError("an index beyond a list")
    return value[index]


def _not_found(name: str, where: tuple[int, int]) -> ScriptError:
    return ScriptError(
        *where, f"compile_error_name_not_found:{name}:", f"there is no `{name}`, or this emulator does not have it"
    )
