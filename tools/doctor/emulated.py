"""The emulators that doctor looks at, in a process of their own: `python -m tools.doctor.emulated` (job on stdin)."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator, Sequence

import msgspec
from msgspec.structs import replace

from robot_io.clock import monotonic_ns
from robot_io.errors import EnvironmentFault, PushError
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import die_with_parent, set_timer_slack_1ns, try_realtime
from robot_io.ipc.spawn import spawn
from robot_io.ipc.status import StatusPipe
from robot_io.rig.config import RigConfig, rig_from_toml, rig_to_toml
from sim_backend.world.world import World
from tools.rig import devices_at
from tools.run.emulators import Emulator, address_of, open_emulator

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
    status_fd: int = -1


@contextlib.contextmanager
def emulators(rig: RigConfig, kind_folder: str, faults: Sequence[str]) -> Iterator[RigConfig]:
    """Serve the rig's devices at level emulated; give the rig with their addresses.

    faults: what is wrong with them, in words. Raises PushError where they cannot be served.
    """
    devices = tuple(devices_at(rig, "emulated"))
    if not devices:
        yield rig
        return
    job = EmulatedJob(rig_to_toml(rig), kind_folder, devices, tuple(faults), os.getpid())
    child = spawn("emulators", "tools.doctor.emulated", job, [])
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


def with_addresses(rig: RigConfig, addresses: dict[str, str]) -> RigConfig:
    """Return the rig with the addresses of its emulators filled in."""
    if "ft" in addresses:
        rig = replace(rig, ft=replace(rig.ft, port=addresses["ft"]))
    if "arm" in addresses:
        rig = replace(rig, arm=replace(rig.arm, host=addresses["arm"]))
    if "base" in addresses:
        rig = replace(rig, base=replace(rig.base, url=addresses["base"]))
    return rig


def main() -> int:
    """Serve until SIGTERM; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=EmulatedJob)
    die_with_parent(job.parent_pid, signal.SIGTERM)
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    rig = rig_from_toml(job.rig_toml)
    loop = EventLoop()
    opened: dict[str, Emulator] = {}
    try:
        world = World(rig, 0, monotonic_ns())
        for device in job.devices:
            opened[device] = open_emulator(loop, world, rig, device, job.kind_folder)
    except PushError as error:
        status.error(error)
        return error.exit_code
    try_realtime(PRIORITY)
    addresses = {device: address_of(emulator) for device, emulator in opened.items()}
    status.say("ready", addresses=addresses)
    loop.run()  # SIGTERM ends the process: its ports and sockets go with it
    return 0


if __name__ == "__main__":
    sys.exit(main())
