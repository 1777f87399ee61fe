"""The emulators that doctor looks at, in a process of their own: `python -m tools.doctor.emulated` (job on stdin)."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence

import msgspec

from robot_io.clock import monotonic_ns
from robot_io.errors import ConfigError, EnvironmentFault, PushError
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import die_with_parent, set_timer_slack_1ns, try_realtime
from robot_io.ipc.spawn import spawn
from robot_io.ipc.status import StatusPipe
from robot_io.rig.config import RigConfig, rig_from_toml, rig_to_toml
from robot_io.rig.declared import TOOL_FORCE
from robot_io.rig.fault_words import WHERE
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.injection.wire_arm import spoil_arm
from sim_backend.injection.wire_base import spoil_base
from sim_backend.injection.wire_sensor import LINE_KINDS, spoil_sensor, spoil_tool_force
from sim_backend.injection.wire_words import parse_wire_fault
from sim_backend.ridgeback.emulator import RosbridgeEmulator
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.world.world import World
from tools.kinds import is_shipped
from tools.rig import devices_at, kinds_of, with_addresses
from tools.run.emulated.emulators import Emulator, addresses_of, open_emulators
from tools.run.emulated.hands import Hands

READY_WITHIN_S = 20.0
ENDS_WITHIN_S = 2.0
PRIORITY = 70


class EmulatedJob(msgspec.Struct, frozen=True):
    """What to serve."""

    rig_toml: str
    kind_folder: str
    devices: tuple[str, ...]
    faults: tuple[str, ...]
    parent_pid: int
    hands_fd: int = -1
    """Where lines of what a person does to the robot come from; -1: nobody is there."""
    status_fd: int = -1


@contextlib.contextmanager
def emulators(rig: RigConfig, kind_folder: str, faults: Sequence[str], hands_fd: int = -1) -> Iterator[RigConfig]:
    """Serve the rig's devices at level emulated; give the rig with their addresses.

    faults: what is wrong with them, in words. hands_fd: the reading end of a pipe for the lines of
    `tools.run.emulated.hands`, which stays the caller's. Raises PushError where they cannot be served.
    """
    check_faults(rig, faults)
    devices = tuple(devices_at(rig, "emulated"))
    if not devices:
        yield rig
        return
    job = EmulatedJob(rig_to_toml(rig), kind_folder, devices, tuple(faults), os.getpid(), hands_fd)
    child = spawn("emulators", "tools.doctor.emulated", job, [] if hands_fd < 0 else [hands_fd])
    try:
        if not child.wait_ready(READY_WITHIN_S):
            if child.errors:
                raise child.errors[0]
            child.stop(ENDS_WITHIN_S)
            raise EnvironmentFault(f"the emulators did not start: {child.how_it_ended()}")
        yield with_addresses(rig, (child.ready or {})["addresses"])
    finally:
        child.stop(ENDS_WITHIN_S)
        child.close()


def spoil(loop: EventLoop, opened: Mapping[str, Emulator], faults: Sequence[str], rig: RigConfig) -> None:
    """Let the emulators do wrong what `faults` say."""
    words = [parse_wire_fault(text) for text in faults]
    for device, emulator in opened.items():
        mine = [fault for fault in words if fault.device.partition(".")[0] == device]
        if isinstance(emulator, Ft300Emulator):
            spoil_sensor(emulator, mine, rig)
        elif isinstance(emulator, UrEmulator) and device == "ft":
            spoil_tool_force(emulator, mine, rig)
        elif isinstance(emulator, UrEmulator):
            spoil_arm(emulator, mine)
        elif isinstance(emulator, RosbridgeEmulator):
            spoil_base(loop, emulator, mine, rig)


def check_faults(rig: RigConfig, faults: Sequence[str]) -> None:
    """Raise ConfigError for a fault that cannot be read, or that no emulated device of the rig can do."""
    for text in faults:
        device = parse_wire_fault(text).device.partition(".")[0]
        if device not in devices_at(rig, "emulated") or not is_shipped(device, kinds_of(rig)[device]):
            raise ConfigError(
                f"`{text}`: {device} is not emulated by this program in rig {rig.name!r}",
                where=WHERE,
                do="Use the rig `emulated`",
            )
        if device == "ft" and rig.ft.kind == TOOL_FORCE and parse_wire_fault(text).kind in LINE_KINDS:
            raise ConfigError(
                f"`{text}`: {TOOL_FORCE} has no line of its own", where=WHERE, do="Let the arm do it, or use an FT 300"
            )


def main() -> int:
    """Serve until SIGTERM; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=EmulatedJob)
    die_with_parent(job.parent_pid, signal.SIGTERM)
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    rig = rig_from_toml(job.rig_toml)
    loop = EventLoop()
    try:
        world = World(rig, 0, monotonic_ns())
        opened = open_emulators(loop, world, rig, job.devices, job.kind_folder)
    except PushError as error:
        status.error(error)
        return error.exit_code
    addresses = addresses_of(opened)  # as a rig would name them: a fault may take a port away
    spoil(loop, opened, job.faults, rig)
    if job.hands_fd >= 0:
        Hands(loop, job.hands_fd, world, lambda words: print(words, file=sys.stderr))
    try_realtime(PRIORITY)
    status.say("ready", addresses=addresses)
    loop.run()  # SIGTERM ends the process: its ports and sockets go with it
    return 0


if __name__ == "__main__":
    sys.exit(main())
