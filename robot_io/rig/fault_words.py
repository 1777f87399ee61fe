"""The words for a fault that is injected into a simulated or emulated run: `DEVICE.KIND[=VALUE] at T s [for T s]`.

    ft.frozen at 3 s for 1 s
    base.pose.turned=20 at 0 s
    arm.protective-stop at 4.5 s

T counts from the first tick. VALUE is one number or several with commas; without it the kind's own default counts.
What each kind does to a device's samples: `sim_backend.injection`.
"""

from __future__ import annotations

import difflib
import math
import re

import msgspec

from robot_io.errors import ConfigError

WHERE = "fault to inject"
_WORD = re.compile(
    r"(?P<name>[a-z][a-z.]*\.[a-z-]+)(?:=(?P<value>\S+))?\s+at\s+(?P<at>\S+)\s*s(?:\s+for\s+(?P<span>\S+)\s*s)?"
)


class FaultKind(msgspec.Struct, frozen=True):
    """One kind of fault of one device: what it does, and what its value is."""

    text: str
    default: tuple[float, ...] = ()
    """The value where none is given; empty: it takes none."""
    most: int = 1
    """How many numbers a value may have."""
    above: float = -math.inf
    """Every number of a value is greater than this."""


def _any_stream(numbers: int, meaning: str, scaled: str = "all numbers are =N times as large") -> dict[str, FaultKind]:
    """Return the kinds that every stream of samples has; `meaning` says what its numbers are."""
    return {
        "off": FaultKind("nothing arrives"),
        "frozen": FaultKind("the first sample is repeated, with new times"),
        "garbage": FaultKind("no number is a number; with =N, random ones up to N", (math.nan,)),
        "wrong": FaultKind(f"=N,... is added to {meaning}", (1.0,), numbers),
        "scaled": FaultKind(scaled, (2.0,)),
        "slow": FaultKind("=N samples a second pass", (10.0,), above=0.0),
        "delayed": FaultKind("everything arrives =N s later", (0.2,), above=0.0),
        "intermittent": FaultKind("nothing arrives in the first half of every =N s", (0.4,), above=0.0),
    }


KINDS: dict[str, dict[str, FaultKind]] = {
    "ft": _any_stream(6, "fx, fy, fz (N), mx, my, mz (N m), SENSOR frame")
    | {
        "mirrored": FaultKind("force and torque have the opposite sign"),
        "turned": FaultKind("force and torque are turned about the vertical by =N degrees", (90.0,)),
        "drifting": FaultKind("the force moves away by =N,N,N newton a second, SENSOR frame", (0.0, 0.0, -1.0), 3),
        "saturated": FaultKind("axis =N (0 to 5) is at the end of its range", (2.0,), above=-1.0),
        "spike": FaultKind("one sample in fifty is =N newton off along z", (100.0,)),
        "dead-axis": FaultKind("axis =N (0 to 5) repeats its first value", (2.0,), above=-1.0),
        "crc": FaultKind("one packet in =N is damaged", (2.0,), above=0.0),
        "junk": FaultKind("one packet in =N is torn by a stray byte, and its bytes are junk", (2.0,), above=0.0),
        "zeroed": FaultKind("somebody zeroes the sensor: its bias jumps to what it then reads"),
        "lost": FaultKind("the link is gone"),
    },
    "arm": _any_stream(6, "the joints (rad)")
    | {
        "moving": FaultKind("the joints turn at =N,... rad/s, and say so", (0.05,), 6),
        "drifting": FaultKind("the joints turn at =N,... rad/s, unnoticed by the arm", (0.002,), 6),
        "protective-stop": FaultKind("the arm is in a protective stop"),
        "emergency-stop": FaultKind("the arm is in an emergency stop"),
        "powered-off": FaultKind("the arm is powered off"),
        "freedrive": FaultKind("the arm may be moved by hand"),
        "other-program": FaultKind("another program runs on the arm"),
        "lost": FaultKind("the link is gone"),
    },
    "base.pose": _any_stream(3, "x, y (m) and yaw (rad), WORLD frame", "its way from where it was is =N times as long")
    | {
        "mirrored": FaultKind("its way from where it was has the opposite sign"),
        "turned": FaultKind("its way from where it was is turned by =N degrees", (90.0,)),
        "drifting": FaultKind("x, y and yaw move away by =N,N,N m/s, m/s, rad/s", (0.0, 0.1), 3),
        "trembling": FaultKind("it jumps about where it was by up to =N m", (0.005,), above=0.0),
        "swapped": FaultKind("it is the pose of the object"),
        "invalid": FaultKind("the message holds no usable pose"),
    },
    "base.odometry": _any_stream(3, "vx, vy (m/s) and omega (rad/s), BODY frame")
    | {
        "mirrored": FaultKind("the velocity has the opposite sign"),
        "turned": FaultKind("the velocity is turned by =N degrees", (90.0,)),
    },
    "base.command": _any_stream(3, "vx, vy (m/s) and omega (rad/s), BODY frame")
    | {
        "garbage": FaultKind("the base obeys random velocities up to =N m/s", (0.3,), above=0.0),
        "mirrored": FaultKind("the base obeys the opposite"),
        "turned": FaultKind("the base obeys a velocity turned by =N degrees", (90.0,)),
        "ignored": FaultKind("the base stands still, whatever it is told"),
        "lost": FaultKind("the link of the base is gone"),
    },
    "base.status": _any_stream(1, "the voltage of the battery")
    | {
        "e-stop": FaultKind("a stop is pressed"),
        "motors-off": FaultKind("the motors are off"),
    },
}
"""Every kind of every device."""


class FaultWord(msgspec.Struct, frozen=True):
    """A fault that was asked for. Times in s from the first tick; `for_s` is infinite where none was given."""

    text: str
    device: str
    kind: str
    value: tuple[float, ...]
    at_s: float
    for_s: float

    def active(self, elapsed_s: float) -> bool:
        """Return whether the fault is present `elapsed_s` after the first tick."""
        return self.at_s <= elapsed_s < self.at_s + self.for_s


def parse_fault(text: str) -> FaultWord:
    """Return the fault that `text` asks for. Raises ConfigError naming what cannot be read."""
    found = _WORD.fullmatch(text.strip())
    if found is None:
        raise ConfigError(
            f"cannot read `{text}`",
            where=WHERE,
            do='Write it like "ft.frozen at 3 s for 1 s" or "base.pose.off at 5 s"',
        )
    device, _, name = found["name"].rpartition(".")
    kind = _kind(device, name)
    value = _numbers(text, found["value"]) if found["value"] else kind.default
    if found["value"] and (not kind.default or len(value) > kind.most or min(value) <= kind.above):
        wanted = f"up to {kind.most} numbers" if kind.most > 1 else "one number"
        wanted += f" above {kind.above:g}" if math.isfinite(kind.above) else ""
        raise ConfigError(
            f"`{device}.{name}` takes {wanted if kind.default else 'no value'}, not `{found['value']}`", where=WHERE
        )
    [at_s] = _numbers(text, found["at"])
    [for_s] = _numbers(text, found["span"]) if found["span"] else (math.inf,)
    if at_s < 0 or for_s <= 0:
        raise ConfigError(f"`{text}`: it begins at 0 s or later and lasts longer than 0 s", where=WHERE)
    return FaultWord(" ".join(text.split()), device, name, value, at_s, for_s)


def _kind(device: str, name: str) -> FaultKind:
    if device not in KINDS:
        near = difflib.get_close_matches(f"{device}.{name}", [f"{d}.{k}" for d in KINDS for k in KINDS[d]], n=1)
        hint = f"Did you mean `{near[0]}`? " if near else ""
        raise ConfigError(f"there is no device `{device}`", where=WHERE, do=f"{hint}Devices: {', '.join(KINDS)}")
    if name not in KINDS[device]:
        near = difflib.get_close_matches(name, KINDS[device], n=1)
        hint = f"Did you mean `{near[0]}`? " if near else ""
        known = ", ".join(KINDS[device])
        raise ConfigError(f"`{device}` has no fault `{name}`", where=WHERE, do=f"{hint}It has {known}")
    return KINDS[device][name]


def _numbers(text: str, listed: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(one) for one in listed.split(","))
    except ValueError:
        numbers = (math.nan,)
    if not all(map(math.isfinite, numbers)):
        raise ConfigError(f"`{text}`: `{listed}` is not a number", where=WHERE)
    return numbers
