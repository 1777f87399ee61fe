"""Read the text below fields and enum members from the source, because Python does not keep it at run time."""

from __future__ import annotations

import ast
import inspect
from types import ModuleType


def notes_of(*modules: ModuleType) -> dict[tuple[str, str], str]:
    """Return the text below each field of each class of the modules, by (class, field), on one line."""
    notes = {}
    for node in (node for module in modules for node in ast.parse(inspect.getsource(module)).body):
        if not isinstance(node, ast.ClassDef):
            continue
        for field, text in zip(node.body, node.body[1:], strict=False):
            name = _name(field)
            if name and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                notes[node.name, name] = " ".join(str(text.value.value).split())
    return notes


def _name(field: ast.stmt) -> str:
    if isinstance(field, ast.AnnAssign):
        target: ast.expr = field.target
    elif isinstance(field, ast.Assign) and len(field.targets) == 1:
        target = field.targets[0]
    else:
        return ""
    return target.id if isinstance(target, ast.Name) else ""
