"""Render classes and functions as Markdown, from their docstrings, signatures and the text below their fields."""

from __future__ import annotations

import ast
import enum
import inspect
import itertools
import re
import sys
import textwrap
from collections.abc import Iterator
from types import ModuleType
from typing import Any, ForwardRef

import msgspec

from robot_io.rig.notes import notes_of

WIDEST = 96
"""A longer signature gets one line per parameter."""


def entry(name: str, module: ModuleType, linked: set[str]) -> str:
    """Return the Markdown section of one public name; types in `linked` become links."""
    member = getattr(module, name)
    lines = [f"### {name}\n"]
    if inspect.isclass(member):
        lines += _class(member, linked)
    elif inspect.isroutine(member):
        lines += [_code(f"{name}{_signature(member)}"), _prose(member)]
    else:
        lines += _constant(name, module)
    return "\n".join(lines).rstrip() + "\n"


def prose(text: str, parameters: frozenset[str] = frozenset()) -> str:
    """Return a docstring (`inspect.cleandoc`) as Markdown.

    A line `parameter: text`, with the indented lines below it, becomes a list item; every `*` is kept literally.
    """
    lines: list[str] = []
    in_item = False
    for line in text.splitlines():
        named = re.match(r"(\w+): ", line)
        if named and named[1] in parameters:
            lines.append(f"- `{named[1]}`: {_escaped(line[named.end() :])}")
            in_item = True
        else:
            if in_item and line and not line.startswith("    "):
                lines.append("")  # otherwise it would belong to the item
            in_item = in_item and line.startswith("    ")
            lines.append(f"  {_escaped(line.strip())}" if in_item else _escaped(line))
    return "\n".join(lines) + "\n"


def _escaped(line: str) -> str:
    if line.startswith("    "):
        return line
    parts = line.split("`")
    return "`".join(part if index % 2 else part.replace("*", "\\*") for index, part in enumerate(parts))


def _prose(member: Any) -> str:
    return prose(_doc(member), frozenset(inspect.signature(member).parameters))


def _doc(member: Any) -> str:
    return inspect.cleandoc(member.__doc__ or "")


def _code(text: str) -> str:
    return f"```python\n{text}\n```\n"


def _class(member: type[Any], linked: set[str]) -> list[str]:
    notes = _notes(member)
    if issubclass(member, enum.Enum):
        return [
            prose(_doc(member)),
            *_table("value", [(i.name, str(i.value), notes.get(i.name, "")) for i in member]),
        ]
    plain = not issubclass(member, msgspec.Struct | tuple) and not getattr(member, "_is_protocol", False)
    has_init = plain and "__init__" in vars(member)
    lines = [_code(f"{member.__name__}{_signature(member, returns=False)}")] if has_init else []
    lines.append(_prose(member) if has_init else prose(_doc(member)))
    shown = {name: kind for name, kind in _annotations(member) if not has_init or notes.get(name)}
    shown |= {name: _returned(found.fget) for name, found in vars(member).items() if isinstance(found, property)}
    rows = [(name, _linked(kind, linked), notes.get(name, "")) for name, kind in shown.items()]
    lines += _table("type", rows)
    for name, method in _methods(member):
        called = f"{name}{_signature(method)}"
        lines += [f"#### {name}\n", _code(called)] if "\n" in called else [f"#### `{called}`\n"]
        lines.append(_prose(method))
    return lines


def _constant(name: str, module: ModuleType) -> list[str]:
    """Return the value of a constant, if it is short, and the text below it."""
    body = ast.parse(inspect.getsource(module)).body
    for node, below in itertools.pairwise(body):
        target, text = _target(node), _text_in(below)
        if isinstance(target, ast.Name) and target.id == name and text:
            code = ast.unparse(node)
            shown = [_code(code)] if len(code) <= WIDEST else []
            return [*shown, prose(text)]
    raise LookupError(f"{module.__name__} has no {name} with text below it")


def _target(node: ast.stmt) -> ast.expr | None:
    if isinstance(node, ast.Assign):
        return node.targets[-1]
    return node.target if isinstance(node, ast.AnnAssign) else None


def _text_in(node: ast.stmt) -> str:
    """Return a string statement's text on one line; "" for any other statement."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return " ".join(str(node.value.value).split())
    return ""


def _table(second: str, rows: list[tuple[str, str, str]]) -> list[str]:
    if not any(text for _, _, text in rows):
        return [f"Fields: {', '.join(f'`{name}` ({kind})' for name, kind, _ in rows)}.\n"] if rows else []
    body = [f"| `{name}` | {kind} | {_escaped(text)} |".replace("|  |", "| |") for name, kind, text in rows]
    return [f"| | {second} | |\n|---|---|---|", *body, ""]


def _linked(kind: str, linked: set[str]) -> str:
    if kind in linked:
        return f"[{kind}](#{kind.lower()})"
    return f"`{kind}`".replace("|", "\\|")


def _annotations(member: type[Any]) -> Iterator[tuple[str, str]]:
    """Yield name and type of the public fields and of the attributes that `__init__` creates and documents."""
    for name, kind in inspect.get_annotations(member).items():
        if not name.startswith("_"):
            text = kind.__forward_arg__ if isinstance(kind, ForwardRef) else str(kind)  # a NamedTuple wraps its types
            text = re.sub(r"^ClassVar\[(.*)\]$", r"\1", text)
            yield name, re.sub(r"^Annotated\[(\w+), '.*\]$", r"\1", text.replace('"', "'"))  # its width in a log
    for name, kind, _ in _attributes(member):
        yield name, kind


def _attributes(member: type[Any]) -> Iterator[tuple[str, str, str]]:
    """Yield name, type and text of each `self.name = ...` of `__init__` that has a text below it."""
    if "__init__" not in vars(member) or not inspect.isfunction(member.__init__):
        return
    source = textwrap.dedent(inspect.getsource(member.__init__))
    [init] = ast.parse(source).body
    assert isinstance(init, ast.FunctionDef)
    for node, below in itertools.pairwise(init.body):
        target, text = _target(node), _text_in(below)
        if text and isinstance(target, ast.Attribute) and not target.attr.startswith("_"):
            assert isinstance(node, ast.Assign | ast.AnnAssign)
            if isinstance(node, ast.AnnAssign):
                kind = ast.unparse(node.annotation)
            else:
                kind = type(ast.literal_eval(node.value)).__name__
            yield target.attr, kind, text


def _notes(member: type[Any]) -> dict[str, str]:
    """Return the text below each field of a class, and the first line of each property."""
    found = notes_of(sys.modules[member.__module__])
    notes = {field: text for (name, field), text in found.items() if name == member.__name__}
    notes |= {name: text for name, _, text in _attributes(member)}
    for name, value in vars(member).items():
        if isinstance(value, property):
            notes[name] = inspect.cleandoc(value.__doc__ or "").splitlines()[0]
    return notes


def _methods(member: type[Any]) -> Iterator[tuple[str, Any]]:
    """Yield the public methods with a docstring of their own."""
    for name, found in vars(member).items():
        method = found.__func__ if isinstance(found, classmethod | staticmethod) else found
        if name.startswith("_") or not inspect.isfunction(method) or not method.__doc__:
            continue
        if not method.__doc__.startswith("See `"):
            yield name, method


def _returned(function: Any) -> str:
    return str(inspect.signature(function).return_annotation)


def _signature(member: Any, *, returns: bool = True) -> str:
    """Return parameters with types and defaults, as in the source but without self."""
    signature = inspect.signature(member)
    shown = []
    starred = False
    for name, parameter in signature.parameters.items():
        if name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            starred = True
            shown.append("*")
        default = "" if parameter.default is parameter.empty else f" = {_value(parameter.default)}"
        shown.append(f"{name}: {parameter.annotation}{default}")
    end = f") -> {signature.return_annotation}" if returns else ")"
    line = f"({', '.join(shown)}{end}"
    return line if len(line) <= WIDEST else "(\n" + "".join(f"    {one},\n" for one in shown) + end


def _value(default: Any) -> str:
    if inspect.isfunction(default):
        return default.__name__
    if isinstance(default, str):
        return f'"{default}"'
    return f"{type(default).__name__}()" if isinstance(default, msgspec.Struct) else repr(default)
