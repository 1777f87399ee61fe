"""Both generations of UR controllers: which PolyScope is which, its rate and its models. Pure.

Sources: user manuals CB3 3.15 and e-Series 5.12, RTDE guide (rates, versions of outputs), dashboard server manuals.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from robot_io.errors import ConfigError, DeviceProtocolError

Version = tuple[int, int, int, int]
DASHBOARD_TEXT_LIMIT = 40
"""No more than this of an answer goes into a message."""


class Generation(msgspec.Struct, frozen=True):
    """One generation of controllers."""

    name: str
    major: int
    """Of its PolyScope."""
    least_minor: int
    """Older ones lack something that this driver asks for."""
    rate_hz: float
    """Control cycles, and with them packets, in a second."""
    models: tuple[str, ...]
    safety_question: str
    """What the dashboard is asked for the safety state; the answer begins with the same word."""

    @property
    def cycle_s(self) -> float:
        """Return the length of a control cycle."""
        return 1.0 / self.rate_hz

    @property
    def cycle_ns(self) -> int:
        """Return the length of a control cycle."""
        return round(1e9 / self.rate_hz)


CB3 = Generation("CB3", 3, 15, 125.0, ("UR3", "UR5", "UR10"), "safetymode")
E_SERIES = Generation("e-Series", 5, 4, 500.0, ("UR3e", "UR5e", "UR10e", "UR16e"), "safetystatus")
"""From 5.4 on its dashboard says by `safetystatus` why a safeguard stop came."""
GENERATIONS = (CB3, E_SERIES)
MODELS = tuple(model for generation in GENERATIONS for model in generation.models)


def generation_of(host: str, version: Version) -> Generation:
    """Return which generation a PolyScope belongs to. Raises DeviceProtocolError for one that is not known."""
    major, minor = version[:2]
    for generation in GENERATIONS:
        if major == generation.major and minor >= generation.least_minor:
            return generation
    needed = " or ".join(f"{one.major}.{one.least_minor} or a newer {one.major}.x ({one.name})" for one in GENERATIONS)
    raise DeviceProtocolError(
        f"the controller runs PolyScope {'.'.join(map(str, version))}, this driver needs {needed}",
        where=host,
        do="Update the controller, or use a UR with a CB3 or e-Series controller",
    )


def model_of(host: str, generation: Generation, answer: str, wanted: str = "") -> str:
    """Return the model (`UR10e`) from the dashboard's answer, where the e of an e-Series arm is missing.

    wanted: the model that it must be; empty for any. Raises DeviceProtocolError for another or an unknown one.
    """
    found = answer if answer in generation.models else f"{answer}e"
    if found not in generation.models:
        raise DeviceProtocolError(
            f"this is a {answer[:DASHBOARD_TEXT_LIMIT]!r}, which is none of the {generation.name} arms",
            where=host,
            do=f"Give the address of one of {', '.join(MODELS)}",
        )
    if wanted and found != wanted:
        raise DeviceProtocolError(
            f"this is a {found}, not the {wanted} that the rig says",
            where=host,
            do=f"Give the address of the {wanted}, or correct the rig's `model` and, with it, its frames",
        )
    return found


def wanted_model(options: Mapping[str, Any]) -> str:
    """Return the `model` of a rig's `[arm.options]`, empty for any. Raises ConfigError for one that is not known."""
    model = options.get("model", "")
    if model not in ("", *MODELS):
        known = ", ".join(MODELS)
        raise ConfigError(f"there is no UR called {model!r}", where="arm.options.model", do=f"One of {known}")
    return str(model)
