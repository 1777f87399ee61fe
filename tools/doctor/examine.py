"""Runs all checks of a rig: its devices one after the other, then this machine, then the rig itself."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence

from robot_io.rig.config import RigConfig
from robot_io.rig.declared import TOOL_FORCE
from tools.doctor.check import NAMES, Check
from tools.doctor.emulated import emulators
from tools.doctor.host_checks import host_checks
from tools.doctor.rig_checks import rig_checks
from tools.kinds import is_shipped
from tools.rig import kinds_of

DEVICES = ("ft", "arm", "base")
Held = Mapping[str, str]
"""Who holds a device, in words, for each device that is held."""


def looked_at(
    rig: RigConfig,
    kind_folder: str,
    *,
    held: Held,
    faults: Sequence[str] = (),
    real_only: bool = False,
    prove: bool = False,
) -> Iterator[Check]:
    """Give every row as it is found; about 10 s for a rig whose devices answer. Nothing moves.

    Devices at level emulated are served meanwhile, with `faults`; with `real_only` they are skipped.
    prove: the base is moved, where all that was seen of it is well. Raises PushError where they cannot be served.
    """
    with contextlib.nullcontext(rig) if real_only else emulators(rig, kind_folder, faults) as served:
        for device in DEVICES:
            checks = device_checks(served, device, held)
            yield from checks
        if prove:
            yield _proof(served, kind_folder, checks)
    yield from host_checks(rig)
    yield from rig_checks(rig)


def _proof(rig: RigConfig, kind_folder: str, base: Sequence[Check]) -> Check:
    """Prove the base's timeout, unless something is wrong with it or nobody looked."""
    from tools.doctor.consent import ask_once
    from tools.doctor.prove import prove_base_timeout

    results = {check.result for check in base}
    if "failed" in results or results == {"skipped"}:
        return Check("base.timeout", "skipped", evidence="the base is not in order, so it was not moved")
    ask_once(rig, "Drive 2 cm now?")
    return prove_base_timeout(rig, kind_folder)


def device_checks(rig: RigConfig, device: str, held: Held) -> list[Check]:
    """Return the rows of ft, arm or base, whose address is in the rig."""
    level = {"ft": rig.ft.level, "arm": rig.arm.level, "base": rig.base.level}[device]
    kind = kinds_of(rig)[device]
    if level == "sim":
        return _skipped(device, "level sim has no devices")
    if not {"ft": rig.ft.port, "arm": rig.arm.host, "base": rig.base.url}[device] and level == "emulated":
        return _skipped(device, "emulated, and not served yet")
    if device in held:
        return _skipped(device, f"in use by another run ({held[device]})")
    if not is_shipped(device, kind):
        return _skipped(device, f"`{kind}` is not of this program")
    return _checks(device, kind)(rig)


def _checks(device: str, kind: str) -> Callable[[RigConfig], list[Check]]:
    """Return the checks of a device; imported late, because level sim needs no wire."""
    if kind == TOOL_FORCE:
        from tools.doctor.tool_force_checks import tool_force_checks

        return tool_force_checks
    if device == "ft":
        from tools.doctor.ft_checks import ft_checks

        return ft_checks
    if device == "arm":
        from tools.doctor.arm_checks import arm_checks

        return arm_checks
    from tools.doctor.base_checks import base_checks

    return base_checks


def _skipped(device: str, why: str) -> list[Check]:
    return [Check(f"{device}.{name}", "skipped", evidence=why) for name in NAMES[device]]
