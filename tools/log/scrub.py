"""Takes addresses, ports and names of people and machines out of texts, the same everywhere in one artifact."""

from __future__ import annotations

import re
from collections import Counter
from ipaddress import ip_address
from urllib.parse import urlsplit

from robot_io.rig.config import RigConfig

GENERIC = frozenset(
    ("root", "user", "admin", "ubuntu", "debian", "pi", "robot", "ros", "student", "lab", "push", "localhost", "base")
)
"""Names of accounts and machines that name nobody; taking them out would change words that mean something else."""
_HOME = re.compile(r"(?<![\w/])/(?:home|Users)/[^/\s\"'\\:,;)<]+|(?<![\w/])/root(?=/|\b)")
_BY_ID = re.compile(r"/dev/serial/by-(?:id|path)/[^\s\"'\\,;)<]+")
_IPV4 = re.compile(r"(?<![\w.])(?:\d{1,3}\.){3}\d{1,3}(?![\w.]*\d)")
_IPV6 = re.compile(r"\[[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*\]")
_MAIL = re.compile(r"[\w.+-]+@[\w-]+(?:\.[\w-]+)+")
_BLOBS = re.compile(r"(data:[\w/+.-]+;base64,[A-Za-z0-9+/=]+)")


class Scrub:
    """Replaces in texts; `counts` says of each kind how often.

    names: of the user and the machine, where they say who that is. folder: where the runs are, as an absolute path.
    """

    def __init__(self, names: tuple[str, ...], folder: str) -> None:
        self.counts: Counter[str] = Counter()
        words = sorted({name for name in names if len(name) > 2 and name.lower() not in GENERIC}, key=len, reverse=True)
        self._words = re.compile(rf"(?<!\w)(?:{'|'.join(map(re.escape, words))})(?!\w)") if words else None
        self._literals: dict[str, tuple[str, str]] = {folder: ("folders", "runs")} if len(folder) > 1 else {}

    def add_rig(self, rig: RigConfig) -> None:
        """Have the addresses of a rig replaced by ones that mean nothing but can still be read."""
        found = (("ft", rig.ft.port, "ports"), ("arm", rig.arm.host, "hosts"), ("base", rig.base.url, "hosts"))
        for device, address, kind in found:
            host = _host(address)
            if not address or _is_loopback(host):
                continue
            scheme = f"{address.split('://')[0]}://" if "://" in address else ""
            nothing = f"{scheme}{device}.invalid" if scheme or kind == "hosts" else f"/dev/{device}.invalid"
            self._literals[address] = (kind, f"{nothing}:9090" if scheme else nothing)
            if host != address:
                self._literals[host] = (kind, f"{device}.invalid")

    def text(self, text: str) -> str:
        """Return the text without them; what is embedded as base64 stays as it is."""
        parts = _BLOBS.split(text)
        return "".join(part if i % 2 else self._plain(part) for i, part in enumerate(parts))

    def _plain(self, text: str) -> str:
        for literal, (kind, nothing) in sorted(self._literals.items(), key=lambda one: -len(one[0])):
            self.counts[kind] += text.count(literal)
            text = text.replace(literal, nothing)
        text = self._sub(_BY_ID, "ports", "/dev/ft.invalid", text)
        text = self._sub(_HOME, "home folders", "/home/user", text)
        text = self._sub(_MAIL, "mail addresses", "somebody@invalid", text)
        text = _IPV6.sub(lambda found: self._address(found[0], "[::]"), text)
        text = _IPV4.sub(lambda found: self._address(found[0], "0.0.0.0"), text)
        return text if self._words is None else self._sub(self._words, "names", "somebody", text)

    def _sub(self, pattern: re.Pattern[str], kind: str, nothing: str, text: str) -> str:
        text, count = pattern.subn(nothing, text)
        self.counts[kind] += count
        return text

    def _address(self, text: str, nothing: str) -> str:
        try:
            if _is_loopback(text.strip("[]")) or ip_address(text.strip("[]")).is_unspecified:
                return text
        except ValueError:
            return text
        self.counts["hosts"] += 1
        return nothing


def _host(address: str) -> str:
    try:
        return (urlsplit(address).hostname or address) if "://" in address else address
    except ValueError:
        return address


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
