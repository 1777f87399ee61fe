"""Copies of one of our modules with one thing in them wrong, to see that a test notices."""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Callable, Iterator
from types import ModuleType


def load(module_name: str, tree: ast.Module) -> ModuleType:
    """Return a module made from a changed syntax tree; the real one is left alone."""
    copy = ModuleType(module_name)
    copy.__dict__["__file__"] = f"<mutant of {module_name}>"
    exec(compile(ast.fix_missing_locations(tree), copy.__dict__["__file__"], "exec"), copy.__dict__)
    return copy


def tree_of(module_name: str) -> ast.Module:
    """Return the syntax tree of a module's source."""
    return ast.parse(inspect.getsource(importlib.import_module(module_name)))


def within(tree: ast.Module, names: tuple[str, ...]) -> Iterator[ast.AST]:
    """Yield every node inside the named functions or methods."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name in names:
            yield from (inner for child in node.body for inner in ast.walk(child))


def sign_mutants(module_name: str, *functions: str) -> list[tuple[str, Callable[[], ModuleType]]]:
    """Return (where, make) for every sign in the functions: plus and minus exchanged, unary minus dropped."""
    count = sum(_has_sign(node) for node in within(tree_of(module_name), functions))

    def make(index: int) -> ModuleType:
        tree = tree_of(module_name)
        signs = [node for node in within(tree, functions) if _has_sign(node)]
        _flip(signs[index])
        return load(module_name, tree)

    signs = [node for node in within(tree_of(module_name), functions) if _has_sign(node)]
    return [
        (f"{module_name}:{signs[i].lineno}:{signs[i].col_offset} {ast.unparse(signs[i])}", lambda i=i: make(i))
        for i in range(count)
    ]


def _has_sign(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Add | ast.Sub)
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)


def _flip(node: ast.AST) -> None:
    if isinstance(node, ast.BinOp):
        node.op = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
    else:
        assert isinstance(node, ast.UnaryOp)
        node.op = ast.UAdd()
