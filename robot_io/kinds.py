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

from robot_io.errors import ConfigError, DeviceError, PushError
from robot_io.messages import DeviceInfo

SHIPPED: dict[str, dict[str, str]] = {
    "ft": {
        "robotiq-ft300": "robot_io.ft300.driver:Ft300",
        "ur-tool-force": "robot_io.ur10.tool_force:UrToolForce",
    },
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
ATTRIBUTES_OF = {"base": ("before_close", "sent_ns", "newest_inbound_ns", "newest_pong_ns")}
"""What a run reads of a driver that was built."""
PAGE = "docs/add-a-device.md shows what a driver needs"
NOT_FOUND = "Put its folder on PYTHONPATH, or the file beside the rig file"
NOT_SOUND = "Correct the module, or the name of its class"


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
            do=NOT_FOUND if isinstance(error, ModuleNotFoundError) else NOT_SOUND,
        ) from error
    missing = [part for part in PARTS_OF[device] if not hasattr(found, part)]
    if not isinstance(found, type) or missing:
        what = f"lacks `{'`, `'.join(missing)}`" if isinstance(found, type) else "is not a class"
        raise ConfigError(f"`{kind}` {what}", where=where, do=PAGE)
    return found


def build_driver(device: str, kind: str, address: str, options: Mapping[str, Any], *, folder: str = "") -> Any:
    """Return the driver of a kind, not yet open: what `from_rig` makes of the rig's address and options.

    Raises ConfigError as `find_kind`; for whatever else somebody else's `from_rig` raises; for a missing attribute.
    """
    found = find_kind(device, kind, folder)
    with _blamed(kind, ConfigError, shipped=kind in SHIPPED[device]):
        driver = found.from_rig(address, options)
    missing = [name for name in ATTRIBUTES_OF.get(device, ()) if not hasattr(driver, name)]
    if missing:
        raise ConfigError(f"`{kind}` lacks `{'`, `'.join(missing)}`", where=f"{device}.kind", do=PAGE)
    return driver


def started(driver: Any, device: str, kind: str) -> DeviceInfo:
    """Open and start a driver; return its identity. Raises DeviceError, also for whatever else it raises."""
    with _blamed(kind, DeviceError, shipped=kind in SHIPPED[device]):
        info: DeviceInfo = driver.open()
        driver.start()
    return info


@contextlib.contextmanager
def _blamed(kind: str, as_error: type[PushError], *, shipped: bool) -> Iterator[None]:
    """Turn what somebody else's driver raises and should not into an error that names it."""
    try:
        yield
    except PushError:
        raise
    except Exception as error:
        if shipped:  # then it is a defect of this program
            raise
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        raise as_error(f"its driver failed: {reason}", where=kind, do="Fix the driver") from error


@contextlib.contextmanager
def open_device(
    device: str, kind: str, address: str, options: Mapping[str, Any] | None = None, *, folder: str = ""
) -> Iterator[Any]:
    """Open and start the device (ft, arm or base) of a kind; it is stopped and closed at the end.

    Raises ConfigError as `find_kind`, and what the driver's `open` and `start` raise.
    """
    driver = build_driver(device, kind, address, options or {}, folder=folder)
    try:
        started(driver, device, kind)
        yield driver
    finally:
        try:
            driver.stop()
        finally:
            driver.close()
