"""The emulator that a kind of one's own names, in a process of its own, on the world of the rig `emulated`.

with kind_process("ft", "udp_sensor:UdpSensor", folder) as emulator:
    driver = UdpSensor(emulator.address)
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]


class KindProcess(NamedTuple):
    process: subprocess.Popen[str]
    address: str


@contextlib.contextmanager
def kind_process(device: str, kind: str, folder: str) -> Iterator[KindProcess]:
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.wire.kind_process", device, kind, folder],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert address, "the emulator has not started"
        yield KindProcess(process, address)
    finally:
        process.kill()
        process.communicate()


def serve(device: str, kind: str, folder: str) -> None:
    from robot_io.clock import monotonic_ns
    from robot_io.ipc.event_loop import EventLoop
    from robot_io.kinds import find_kind
    from robot_io.rig.config import load_rig
    from sim_backend.world.world import World
    from tools.run.emulated.emulators import ExternalEmulator

    loop = EventLoop()
    world = World(load_rig("emulated"), 0, monotonic_ns())
    print(ExternalEmulator(loop, find_kind(device, kind, folder).Emulator(world, {})).address, flush=True)
    loop.add_fd(sys.stdin.fileno(), lambda _: loop.stop())  # the parent is gone
    loop.run()


if __name__ == "__main__":
    serve(*sys.argv[1:])
