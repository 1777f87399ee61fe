"""Define the changes made to one syntax node: replacement texts by kind of node."""

from __future__ import annotations

import ast
from collections.abc import Iterator

COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
ARITHMETIC: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.BitXor: ("^", "&"),
}
NAMES = {
    "min": "max",
    "max": "min",
    "any": "all",
    "all": "any",
    "sin": "cos",
    "cos": "sin",
    "floor": "ceil",
    "ceil": "floor",
}
SMALL_INT = 16
"""Integers up to this are counts or indexes and change by one; larger ones, and floats, are quantities."""
QUANTITY_FACTOR = 1.5


def constants(value: object) -> Iterator[str]:
    """Yield replacements of a constant; strings and None have none."""
    if isinstance(value, bool):
        yield repr(not value)
    elif isinstance(value, int):
        if value <= SMALL_INT:
            yield repr(value + 1)
        else:
            yield repr(int(value * QUANTITY_FACTOR))
            yield repr(int(value / QUANTITY_FACTOR))
    elif isinstance(value, float):
        if value == 0.0:
            yield "1.0"
        else:
            yield repr(value * QUANTITY_FACTOR)
            yield repr(value / QUANTITY_FACTOR)
    elif isinstance(value, bytes) and value:
        yield repr(bytes([value[0] ^ 1]) + value[1:])


def returned(value: ast.expr) -> Iterator[str]:
    """Yield constants to return instead of `value`; a returned constant is itself changed elsewhere."""
    if isinstance(value, ast.Compare | ast.BoolOp) or (
        isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.Not)
    ):
        yield from ("True", "False")
    elif not isinstance(value, ast.Constant):
        yield "None"


def can_be_negated(test: ast.expr) -> bool:
    """Return whether a condition has no operator that is changed anyway."""
    return not isinstance(test, ast.Compare | ast.BoolOp | ast.Constant) and not (
        isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)
    )


def is_text(node: ast.expr) -> bool:
    """Return whether the node is visibly a string, whose `+` and `%` are not arithmetic."""
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def can_be_dropped(statement: ast.stmt, assigned: dict[str, int]) -> bool:
    """Return whether every name is still assigned without the statement; `assigned` counts assignments."""
    if isinstance(statement, ast.Expr):
        return not isinstance(statement.value, ast.Constant)
    if isinstance(statement, ast.Return):
        return statement.value is None
    if isinstance(statement, ast.Assign):
        targets = [name for target in statement.targets for name in _plain_names(target)]
        return all(assigned.get(name, 0) > 1 for name in targets)
    return isinstance(statement, ast.AugAssign | ast.Raise | ast.Continue | ast.Break | ast.Delete)


def count_assignments(function: ast.FunctionDef) -> dict[str, int]:
    """Return how often each name in a function is assigned, as an argument or in the body."""
    counts: dict[str, int] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.arg):
            counts[node.arg] = counts.get(node.arg, 0) + 1
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            counts[node.id] = counts.get(node.id, 0) + 1
    return counts


def _plain_names(target: ast.expr) -> list[str]:
    if isinstance(target, ast.Tuple | ast.List):
        return [name for part in target.elts for name in _plain_names(part)]
    return [target.id] if isinstance(target, ast.Name) else []
