"""Write docs/rig-files.md from the types of `robot_io/rig`.

python -m tools.dev.rig_reference > docs/rig-files.md
"""

from __future__ import annotations

import inspect
import sys
from datetime import datetime
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from robot_io.rig import calibration, config, task, topics, world
from robot_io.rig.config import RigConfig
from robot_io.rig.notes import notes_of
from robot_io.rig.renames import RENAMED, RETIRED, advice
from robot_io.rig.types import row_of, table_of

INTRO = """# Rig files

A rig file is TOML and describes one robot, real or not. `push run NAME` uses a shipped one (`sim`, `emulated`,
`barrel`, `paper-gains`, `ur10e-emulated`, `thing`), `push run FILE` your own. Write only what differs:

    extends = "emulated"
    name = "mine"

    [control]
    push_speed_m_per_s = 0.08

`include = ["calibration/frame-2026-07-01.toml"]` takes the keys of other files, such as calibrations. First comes
the rig that is extended, then what is included, then the file's own keys. A key in two included files, or in one
and in the file itself, is an error that names both lines. Paths are relative to the file that says `extends` or
`include`. What is included cannot include or extend. `push config show --origin` says where each value was written.

`push config show RIG` prints every value, `push config check RIG` reports every mistake at once, and
`--set control.k_f=0.1` changes one value for one run. The unit is in the key; ranges are checked; for an unknown
key the nearest known one is suggested. The program's own ceilings (`safety/limits.py`) may only be lowered.

Editors complete keys, show their ranges and mark mistakes (VS Code with *Even Better TOML*, others with Taplo) after

    push config schema > rig.schema.json

and with `#:schema ./rig.schema.json` as the first line of the rig.

`level` is set for each device: `sim` (all three or none), `emulated` (the real driver on a wire emulator) or
`hardware`; the last two can be mixed. `ft.port` is a device path, a pty or `socket://host:port`.
"""


RENAMES = """
## Renamed keys

`push config check` reports each of these in a rig file, with its line. In logs they are read according to the log's
format.
"""


def reference() -> str:
    """Return the page."""
    parts = [INTRO]
    notes = notes_of(config, task, calibration, topics, world)
    for title, table in _tables(RigConfig, ""):
        parts.append(f"\n## {f'[{title}]' if title else 'Top level'}\n")
        doc = inspect.cleandoc(table.__doc__ or "")
        parts.append(doc + "\n")
        parts.append("| key | type and range | default | |\n|---|---|---|---|")
        hints = get_type_hints(table, include_extras=True)
        for field in msgspec.structs.fields(table):
            if table_of(hints[field.name]) or row_of(hints[field.name]):
                continue
            note = notes.get((table.__name__, field.name), "").replace("\n", " ").replace("|", "\\|")
            parts.append(f"| `{field.name}` | {_type_text(hints[field.name])} | {_default(field)} | {note} |")
    parts.append(RENAMES)
    parts += [f"- {advice(one.old)}{', and still read' if one.still_read else ''}." for one in RENAMED]
    parts += [f"- {advice(one.key)}." for one in RETIRED]
    return "\n".join(parts) + "\n"


def _tables(table: type[msgspec.Struct], prefix: str) -> list[tuple[str, type[msgspec.Struct]]]:
    found = [(prefix, table)]
    hints = get_type_hints(table)
    for field in msgspec.structs.fields(table):
        name = f"{prefix}.{field.name}" if prefix else field.name
        below = table_of(hints[field.name])
        if below and below is found[-1][1]:  # one text for several tables of a kind
            found[-1] = (f"{found[-1][0]}], [{name}", below)
        elif below and field.name not in ("declared", "law_facts"):  # written by the program
            found += _tables(below, name)
        if row := row_of(hints[field.name]):
            found.append((f"[{name}]", row))
    return found


def _type_text(hint: Any) -> str:
    if get_origin(hint) is Annotated:
        base, *extras = get_args(hint)
        bounds = [b for extra in extras if isinstance(extra, Meta) for b in _bounds(extra)]
        return ", ".join([_type_text(base), *bounds])
    if get_origin(hint) is Literal:
        return " \\| ".join(f"`{value}`" for value in get_args(hint))
    if get_origin(hint) is tuple:
        parts = get_args(hint)
        if parts[-1] is Ellipsis:
            return f"list of {_type_text(parts[0])}"
        return f"{len(parts)} x {_type_text(parts[0])}"
    if isinstance(hint, UnionType) or get_origin(hint) is Union:
        return " or ".join(_type_text(part) for part in get_args(hint) if part is not NoneType)
    if get_origin(hint) is dict:
        return "table"
    names = {float: "number", int: "integer", str: "text", bool: "true or false", datetime: "date and time with zone"}
    return names.get(hint, str(hint))


def _bounds(meta: Meta) -> list[str]:
    signs = (("> ", meta.gt), (">= ", meta.ge), ("< ", meta.lt), ("<= ", meta.le))
    return [f"{sign}{bound:g}" for sign, bound in signs if bound is not None]


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.required:
        return "required"
    if field.default is msgspec.NODEFAULT:
        return "empty"
    if field.default is None:
        return ""
    if isinstance(field.default, tuple):
        return f"`{list(field.default)}`"
    return f"`{field.default!r}`".replace("'", '"')


if __name__ == "__main__":
    sys.stdout.write(reference())
