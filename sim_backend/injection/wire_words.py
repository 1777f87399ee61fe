"""The words for what an emulated device does wrong on the wire from the start: `DEVICE.KIND[=VALUE]`.

    ft.latency=16
    base.second-publisher
    arm.protective-stop at 0 s

Those of `push run --fault` are understood, too, as far as a device on the wire can do them, with or without "at 0 s".
"""

from __future__ import annotations

import difflib
import math
import re

import msgspec

from robot_io.errors import ConfigError
from robot_io.rig.fault_words import KINDS, WHERE, parse_fault

_WORD = re.compile(
    r"(?P<device>ft|arm|base(?:\.[a-z]+)?)\.(?P<kind>[a-z-]+)(?:=(?P<value>\S+))?(?:\s+at\s+0(?:\.0)?\s*s)?"
)

WIRE_KINDS: dict[str, dict[str, tuple[float, ...]]] = {
    "ft": {
        "silent": (), "streaming": (), "latency": (16.0,), "echo": (), "other-device": (), "busy": (), "shared": (),
    },
    "arm": {
        "silent": (), "dashboard-silent": (), "truncated": (20.0,), "version": (10.07,), "other-model": (),
        "safeguard-stop": (), "brakes-on": (), "paused-program": (), "turned": (1.0,), "inputs-taken": (),
    },
    "base": {
        "silent": (), "lag": (0.2,), "no-rosapi": (), "cold": (2.0,), "slow-answers": (0.5,), "command-type": (),
        "pose-type": (), "no-listener": (), "second-publisher": (), "second-client": (), "commanded": (0.1,),
        "clock": (5.0,), "frame": (), "battery": (21.0,),
    },
}  # fmt: skip
"""What only the wire has: for each kind its value where none is given; no value where it takes none."""

ON_THE_WIRE: dict[str, tuple[str, ...]] = {
    "ft": tuple(kind for kind in KINDS["ft"] if kind != "zeroed"),
    "arm": (
        "off", "garbage", "wrong", "moving", "drifting", "protective-stop", "emergency-stop", "powered-off",
        "freedrive", "other-program", "lost",
    ),
    "base.pose": ("off", "slow", "intermittent", "garbage", "invalid"),
    "base.odometry": ("off", "slow", "intermittent", "garbage", "wrong"),
    "base.command": ("ignored", "lost"),
    "base.status": ("off", "slow", "wrong", "e-stop", "motors-off"),
}  # fmt: skip
"""What of the words of `push run --fault` a device on the wire can do."""


class WireFault(msgspec.Struct, frozen=True):
    """One fault of an emulated device, present from the start."""

    text: str
    device: str
    """ft, arm, base, base.pose, base.odometry, base.command or base.status."""
    kind: str
    value: tuple[float, ...]


def parse_wire_fault(text: str) -> WireFault:
    """Return the fault that `text` asks for. Raises ConfigError naming what cannot be read."""
    found = _WORD.fullmatch(text.strip())
    device, kind = (found["device"], found["kind"]) if found else ("", "")
    if found and kind in WIRE_KINDS.get(device, {}):
        return WireFault(text, device, kind, _value(text, found["value"], WIRE_KINDS[device][kind]))
    if found and kind in ON_THE_WIRE.get(device, ()):
        word = parse_fault(f"{device}.{kind}{'=' + found['value'] if found['value'] else ''} at 0 s")
        return WireFault(text, device, kind, word.value)
    known = [f"{name}.{kind}" for names in (WIRE_KINDS, ON_THE_WIRE) for name in names for kind in names[name]]
    near = difflib.get_close_matches(text.partition("=")[0].partition(" ")[0], known, n=3)
    hint = f"Did you mean {', '.join(f'`{one}`' for one in near)}? " if near else ""
    raise ConfigError(
        f"no emulated device can do `{text}`",
        where=WHERE,
        do=f'{hint}Write it like "ft.latency=16" or "arm.protective-stop at 0 s": it is there from the start',
    )


def _value(text: str, given: str | None, default: tuple[float, ...]) -> tuple[float, ...]:
    if given is None:
        return default
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    if not default or not math.isfinite(value):
        raise ConfigError(f"`{text}`: it takes {'one number' if default else 'no value'}", where=WHERE)
    return (value,)
