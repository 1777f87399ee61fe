"""What every measurement has at hand: the rig with its addresses, and whoever does what is asked."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from robot_io.errors import UsageError
from robot_io.rig.config import RigConfig
from tools.calibrate.people import Operator, Terminal
from tools.calibrate.raw import Raw
from tools.calibrate.rehearsal import Rehearsed, emulators
from tools.places.device_locks import DeviceLocks
from tools.rig import devices_at, folder_of

WITHOUT_HANDS = ("bias", "path")
"""What can be measured at emulators that nobody presses, moves or drives."""


class Session(NamedTuple):
    """A rig whose devices can be reached, the folder of its own drivers, and its operator."""

    rig: RigConfig
    folder: str
    operator: Operator
    raw: Raw
    """Takes what is read."""


@contextlib.contextmanager
def open_session(
    rig: RigConfig, rig_name: str, overrides: Sequence[str], *, what: str, rehearsal: int | None
) -> Iterator[Session]:
    """Lock the rig's devices and give them with an operator; emulated ones are started (rig_name, overrides: of what).

    rehearsal: seed of the rehearsed operator, None for a person at the terminal. Raises UsageError where that cannot
    be, EnvironmentFault for devices in use.
    """
    _check(rig, what, rehearsal)
    person = Terminal() if rehearsal is None else None
    with DeviceLocks(rig), contextlib.ExitStack() as opened:
        if devices_at(rig, "emulated"):
            rig, served = opened.enter_context(emulators(rig, rig_name, overrides, rehearsal or 0))
            yield Session(rig, folder_of(rig_name), person or Rehearsed(rig, served, rehearsal or 0), Raw())
        else:
            assert person is not None
            yield Session(rig, folder_of(rig_name), person, Raw())


def _check(rig: RigConfig, what: str, rehearsal: int | None) -> None:
    emulated, where = devices_at(rig, "emulated"), f"rig {rig.name!r}"
    if devices_at(rig, "sim"):
        raise UsageError("level sim has no devices to calibrate", where=where, do="Use `emulated`")
    if rehearsal is not None and len(emulated) < 3:
        raise UsageError("only a rig whose devices are all emulated is rehearsed", where=where, do="Omit --rehearse")
    if rehearsal is None and emulated and what not in WITHOUT_HANDS:
        raise UsageError("nobody can press, move or drive what is emulated", where=where, do="Add --rehearse")
