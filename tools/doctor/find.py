"""The serial adapters that are plugged in, for people."""

from __future__ import annotations

from collections.abc import Sequence

from robot_io.ft300.adapters import Adapter


def adapter_lines(found: Sequence[Adapter]) -> list[str]:
    """Return the adapters for people."""
    if not found:
        return [
            "no serial adapter is plugged in (a missing one: check its cable, and that brltty does not claim it)",
            "nothing was opened",
        ]
    lines = []
    for one in found:
        may = "" if one.may_open else "; you may not open it"
        likely = ", as an FT 300 comes with" if one.likely else ""
        lines.append(f"{one.by_id}  ({one.port}; {one.usb or 'no USB numbers'} {one.product}{likely}{may})")
    return [*lines, "nothing was opened; write the name into ft.port of the rig"]
