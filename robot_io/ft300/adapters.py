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
