"""What `push run` does before a real robot moves: it looks with doctor, and refuses where a check failed."""

from __future__ import annotations

from collections.abc import Sequence

from robot_io.error_report import tell
from robot_io.errors import DeviceError
from robot_io.rig.config import RigConfig
from tools.doctor.check import Check, lines, summary_line
from tools.doctor.examine import looked_at
from tools.doctor.prove import proof_row
from tools.kinds import name_of
from tools.rig import kinds_of

JUDGED_BY_THE_TARE = ("ft.noise", "ft.bias")
"""The run's own tare refuses these at rest, from every packet of the stream, and its log keeps the evidence."""


def look_before_run(rig: RigConfig, kind_folder: str) -> list[Check]:
    """Look at the real devices of a run, whose locks it has; tell failures and warnings; return every row.

    Raises DeviceError where a check failed.
    """
    tell("looking at the devices; nothing moves yet")
    checks = list(looked_at(rig, kind_folder, held={}, real_only=True))
    if rig.base.level == "hardware":
        checks.append(proof_row(rig))
    for line in lines(check for check in checks if check.result in ("failed", "warning")):
        tell(line)
    tell(f"doctor: {summary_line(checks)}")
    if error := refusal(rig, checks):
        raise error
    return checks


def refusal(rig: RigConfig, checks: Sequence[Check]) -> DeviceError | None:
    """Return the error of the checks that failed, None where none did but what the run's tare judges itself."""
    failed = [check for check in checks if check.result == "failed" and check.check not in JUDGED_BY_THE_TARE]
    if not failed:
        return None
    if len(failed) == 1:
        return DeviceError(failed[0].evidence, where=_where(rig, failed[0]), do=failed[0].fix)
    what = "; ".join(f"{_where(rig, check)}: {check.evidence}" for check in failed)
    return DeviceError(what, do="; ".join(f"{_name(rig, check)}: {check.fix}" for check in failed if check.fix))


def _name(rig: RigConfig, check: Check) -> str:
    device = check.check.partition(".")[0]
    return name_of(kinds_of(rig)[device]) if device in kinds_of(rig) else check.check


def _where(rig: RigConfig, check: Check) -> str:
    device, name = check.check.partition(".")[0], _name(rig, check)
    address = {"ft": rig.ft.port, "arm": rig.arm.host, "base": rig.base.url}.get(device, "")
    where = check.where or address
    return where if where.startswith(name) or not where else f"{name} {where}"
