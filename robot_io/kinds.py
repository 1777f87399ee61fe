"""Finds the driver that a rig's `kind` names: a shipped name, or `package.module:Class` of somebody else.

with open_device("ft", "robotiq-ft300", "/dev/ttyUSB0") as sensor:
    print(sensor.drain())
"""

from __future__ import annotations

import contextlib
import difflib
import importlib
import sys
from collections.abc import Iterator, Mapping
from typing import Any

from robot_io.errors import ConfigError

SHIPPED: dict[str, dict[str, str]] = {
    "ft": {"robotiq-ft300": "robot_io.ft300.driver:Ft300"},
    "arm": {"ur": "robot_io.ur10.driver:Ur10"},
    "base": {"ridgeback-rosbridge": "robot_io.ridgeback.driver:Ridgeback"},
}
"""The class of each shipped kind, by device: ft (force-torque sensor), arm, base."""

PARTS = ("from_rig", "open", "start", "drain", "health", "stop", "close")
PARTS_OF = {
    "ft": (*PARTS, "fileno", "facts"),
    "arm": PARTS,
    "base": (*PARTS, "fileno", "command"),
}
"""What a run calls of a driver; a class that lacks one is refused before anything is opened."""


def find_kind(device: str, kind: str, folder: str = "") -> type[Any]:
    """Return the class that `kind` names for a device (ft, arm or base).

    folder: where else to look for `package.module`; goes to the end of sys.path. Importing runs its code.
    Raises ConfigError: no such kind, it cannot be imported, or a part of the protocol is missing.
    """
    where = f"{device}.kind"
    module, _, name = SHIPPED[device].get(kind, kind).partition(":")
    if not name:
        near = difflib.get_close_matches(kind, SHIPPED[device], n=1)
        hint = f"Did you mean `{near[0]}`? " if near else ""
        known = ", ".join(SHIPPED[device])
        raise ConfigError(
            f"there is no kind `{kind}`", where=where, do=f"{hint}Shipped: {known}; your own: package.module:Class"
        )
    if folder and folder not in sys.path:
        sys.path.append(folder)
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # somebody else's module may raise anything
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        raise ConfigError(
            f"`{kind}` cannot be imported: {reason}",
            where=where,
            do="Put its folder on PYTHONPATH, or the file beside the rig file",
        ) from error
    missing = [part for part in PARTS_OF[device] if not hasattr(found, part)]
    if not isinstance(found, type) or missing:
        what = f"lacks `{'`, `'.join(missing)}`" if isinstance(found, type) else "is not a class"
        raise ConfigError(f"`{kind}` {what}", where=where, do="docs/add-a-device.md shows what a driver needs")
    return found


@contextlib.contextmanager
def open_device(
    device: str, kind: str, address: str, options: Mapping[str, Any] | None = None, *, folder: str = ""
) -> Iterator[Any]:
    """Open and start the device (ft, arm or base) of a kind; it is stopped and closed at the end.

    Raises ConfigError as `find_kind`, and what the driver's `open` and `start` raise.
    """
    driver = find_kind(device, kind, folder).from_rig(address, options or {})
    try:
        driver.open()
        driver.start()
        yield driver
    finally:
        try:
            driver.stop()
        finally:
            driver.close()
