"""One run at a time for each real device, whatever the rigs are called. Emulated devices belong to their own run."""

from __future__ import annotations

import fcntl
import hashlib
import ipaddress
import os
import stat
from pathlib import Path
from typing import NamedTuple, Self
from urllib.parse import urlsplit

import msgspec

from robot_io.errors import DeviceUnreachable, EnvironmentFault
from robot_io.look_up import addresses_of
from robot_io.rig.config import RigConfig
from robot_io.rig.declared import TOOL_FORCE
from tools.kinds import is_shipped
from tools.places.state_dir import state_dir
from tools.rig import devices_at, kinds_of


class Resource(NamedTuple):
    """What a run needs for itself: `key` is the same for every way of writing it, `address` is as the rig has it."""

    key: str
    address: str
    device: str
    """ft, arm or base."""


class Holder(msgspec.Struct, frozen=True):
    """Who holds a lock: the content of its file."""

    pid: int
    rig: str


def resources_of(rig: RigConfig) -> list[Resource]:
    """Return what the rig's devices at level hardware need: serial ports, and addresses of hosts. May look up names."""
    real, kinds = devices_at(rig, "hardware"), kinds_of(rig)
    addresses = {"ft": rig.ft.port, "arm": rig.arm.host, "base": rig.base.url}
    sensor_keys = _arm_keys if rig.ft.kind == TOOL_FORCE else _sensor_keys  # the arm's own: one lock for both
    finders = {"ft": sensor_keys, "arm": _arm_keys, "base": _base_keys}
    return [
        Resource(key, addresses[device], device)
        for device in real
        for key in (
            finders[device](addresses[device])
            if is_shipped(device, kinds[device])
            else [f"{kinds[device]} {addresses[device]}"]
        )
    ]


class DeviceLocks:
    """The locks of all real devices of a rig; held until the process ends, released by the kernel."""

    def __init__(self, rig: RigConfig) -> None:
        """Acquire them. Raises EnvironmentFault if another run holds one or a lock's file cannot be opened."""
        self._fds: list[int] = []
        try:
            for resource in {found.key: found for found in resources_of(rig)}.values():
                self._fds.append(_lock(resource, rig.name))
        except BaseException:
            self._release()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._release()

    def _release(self) -> None:
        for fd in self._fds:
            os.close(fd)
        self._fds = []


class FreeDevices:
    """The locks of those real devices of a rig that no run holds; `held` says, for the others, who does."""

    def __init__(self, rig: RigConfig) -> None:
        """Acquire them. Raises EnvironmentFault if a lock's file cannot be opened."""
        self.held: dict[str, str] = {}
        self._fds: list[int] = []
        try:
            needed = resources_of(rig)
            for resource in {found.key: found for found in needed}.values():
                try:
                    self._fds.append(_lock(resource, rig.name))
                except InUse as error:
                    self.held |= {found.device: error.holder for found in needed if found.key == resource.key}
        except BaseException:
            self.__exit__()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for fd in self._fds:
            os.close(fd)
        self._fds = []


class InUse(EnvironmentFault):
    """Another run holds the lock: `holder` says which."""

    def __init__(self, holder: str, where: str) -> None:
        super().__init__(
            f"in use by another run ({holder})", where=where, do="Wait for it, or stop it with Ctrl-C in its terminal"
        )
        self.holder = holder


def _lock(resource: Resource, rig_name: str) -> int:
    """Return the descriptor that holds the lock. Raises InUse, EnvironmentFault."""
    path = state_dir() / f"{hashlib.sha256(resource.key.encode()).hexdigest()[:24]}.lock"
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise EnvironmentFault(
            f"the device's lock cannot be opened: {error.strerror}", where=str(path), do="Remove that file"
        ) from None
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        who = _holder(fd)
        os.close(fd)
        raise InUse(who, resource.address) from None
    os.ftruncate(fd, 0)
    os.pwrite(fd, msgspec.json.encode(Holder(os.getpid(), rig_name)), 0)
    return fd


def _holder(fd: int) -> str:
    try:
        holder = msgspec.json.decode(os.pread(fd, 4096, 0), type=Holder)
    except msgspec.MsgspecError:  # it has the lock and has not written yet
        return "process unknown"
    return f"process {holder.pid}, rig {holder.rig!r}"


def _sensor_keys(port: str) -> list[str]:
    from robot_io.ft300.tcp_link import is_tcp_address  # level sim imports no wire

    if is_tcp_address(port):
        parts = urlsplit(port)
        return _host_keys(parts.hostname or "", f":{parts.port}")
    try:
        found = Path(port).stat()
    except OSError:  # missing: opening it will say so
        return [f"serial {os.path.realpath(port)}"]
    # The device itself, whatever links lead to it.
    return [f"serial {found.st_rdev if stat.S_ISCHR(found.st_mode) else os.path.realpath(port)}"]


def _arm_keys(host: str) -> list[str]:
    return _host_keys(host, " arm")  # its ports are fixed


def _base_keys(url: str) -> list[str]:
    from robot_io.ridgeback.open_socket import parse_url  # level sim imports no wire

    parts = parse_url(url)
    return _host_keys(parts.host, f":{parts.port}")


def _host_keys(host: str, service: str) -> list[str]:
    """Return one key for each address of a host, or one for its name where that cannot be looked up."""
    try:
        addresses = addresses_of(host, where=host)
    except DeviceUnreachable:  # its driver will say so, together with what is wrong with the others
        return [f"{host}{service}"]
    return [f"{_plain(address)}{service}" for address in addresses]


def _plain(address: str) -> str:
    """Return an address in one way of writing: IPv4 inside IPv6 as IPv4."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:  # with a scope (fe80::1%eth0)
        return address
    return str(getattr(parsed, "ipv4_mapped", None) or parsed)
