"""The emulators of a run, in one process: `python -m tools.run.emulator_process` (job on stdin).

World and wire servers share one thread and one epoll. When the run ends, or its launcher dies, they keep serving
for a moment, so that the log shows the wheels coming to rest.
"""

from __future__ import annotations

import gc
import math
import signal
import sys

import msgspec

from robot_io.clock import NS_PER_MS, monotonic_ns
from robot_io.errors import PushError
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import die_with_parent, is_hung_up, lock_memory, set_timer_slack_1ns, try_realtime
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from robot_io.rig.config import rig_from_toml
from sim_backend.world.world import World
from tools.log.world_log import ring_listener
from tools.run.emulated.emulators import addresses_of, open_emulators
from tools.run.jobs import EmulatorJob

PRIORITY = 70
LINGER_NS = 1_000 * NS_PER_MS
ORPHANED_NS = 2_000 * NS_PER_MS
REST_NS = 100 * NS_PER_MS
WATCH_NS = 20 * NS_PER_MS


class StopAtRest:
    """Stops the loop after SIGTERM: when the base has come to rest, or after LINGER_NS at the latest.

    The same ORPHANED_NS after control has ended: a launcher that is frozen sends no SIGTERM.
    """

    def __init__(self, loop: EventLoop, world: World, run_fd: int) -> None:
        self._loop = loop
        self._world = world
        self._run_fd = run_fd
        self._control_gone_ns = 0
        self._asked = False
        self._since_ns = 0
        self._rest_ns = 0
        signal.signal(signal.SIGTERM, self._ask)
        loop.call_every(WATCH_NS, self._check)

    def _ask(self, *_: object) -> None:
        self._asked = True

    def _check(self, _deadline_ns: int) -> None:
        now_ns = monotonic_ns()
        self._world.advance_to(now_ns)
        if not self._control_gone_ns and is_hung_up(self._run_fd):
            self._control_gone_ns = now_ns
        orphaned = self._control_gone_ns and now_ns - self._control_gone_ns >= ORPHANED_NS
        if not (self._asked or orphaned):
            return
        self._since_ns = self._since_ns or now_ns
        twist = self._world.read_base(now_ns).twist
        rest = math.hypot(twist.vx, twist.vy) == 0.0
        self._rest_ns = (self._rest_ns or now_ns) if rest else 0
        if (rest and now_ns - self._rest_ns >= REST_NS) or now_ns - self._since_ns >= LINGER_NS:
            self._loop.stop()


def main() -> int:
    """Serve until SIGTERM; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=EmulatorJob)
    die_with_parent(job.launcher_pid, signal.SIGTERM)
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    rig = rig_from_toml(job.rig_toml)
    loop = EventLoop()
    ring = Ring(job.ring_fd)
    try:
        world = World(rig, job.seed, monotonic_ns(), ring_listener(ring.push))
        opened = open_emulators(loop, world, rig, job.devices, job.kind_folder)
    except PushError as error:
        status.error(error)
        return error.exit_code
    StopAtRest(loop, world, job.run_fd)
    status.say("ready", addresses=addresses_of(opened), realtime=try_realtime(PRIORITY))
    gc.collect()
    gc.freeze()
    lock_memory()
    loop.run()
    for emulator in opened.values():
        emulator.close()
    status.say(
        "finished",
        world_stalls=world.stalls,
        counters={device: emulator.counters for device, emulator in opened.items()},
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
