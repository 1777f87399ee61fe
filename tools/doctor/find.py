"""Serial adapters by the names that stay theirs; nothing is opened, nothing is written."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec
from serial.tools import list_ports

from robot_io.ft300.serial_link import ADAPTER_USB_IDS

BY_ID = Path("/dev/serial/by-id")


class Adapter(msgspec.Struct, frozen=True):
    """One serial adapter."""

    by_id: str
    """Its name for a rig file; the port itself where it has none."""
    port: str
    usb: str
    """Vendor and product number."""
    product: str
    likely: bool
    """Whether it has the numbers of the adapters that an FT 300 comes with."""
    may_open: bool


def adapters(by_id: Path = BY_ID) -> list[Adapter]:
    """Return the adapters that are plugged in, by what the system says of them."""
    names = {os.path.realpath(link): str(link) for link in sorted(by_id.glob("*"))} if by_id.is_dir() else {}
    usb = {os.path.realpath(info.device): info for info in list_ports.comports() if info.vid is not None}
    found = []
    for port in sorted({*names, *usb}):
        info = usb.get(port)
        numbers = f"{info.vid:04x}:{info.pid:04x}" if info else ""
        likely = info is not None and (info.vid, info.pid) in ADAPTER_USB_IDS
        may_open = os.access(port, os.R_OK | os.W_OK)
        product = (info.product or "") if info else ""
        found.append(Adapter(names.get(port, port), port, numbers, product, likely, may_open))
    return found


def adapter_lines(found: list[Adapter]) -> list[str]:
    """Return the adapters for people."""
    if not found:
        return ["no serial adapter is plugged in (a missing one: check its cable, and that brltty does not claim it)"]
    lines = []
    for one in found:
        may = "" if one.may_open else "; you may not open it"
        likely = ", as an FT 300 comes with" if one.likely else ""
        lines.append(f"{one.by_id}  ({one.port}; {one.usb or 'no USB numbers'} {one.product}{likely}{may})")
    return [*lines, "nothing was opened; write the name into ft.port of the rig"]
