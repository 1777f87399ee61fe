"""A UR controller on the wire (CB3 with PolyScope 3.15, e-Series with 5.12), on one loopback address.

It serves RTDE, script upload and dashboard. One thread, one event loop, shared with whatever else runs in it. Joints
come from the world; motion by a program or a fault is added to them (`motion`) and does not feed back into the world.
"""

from __future__ import annotations

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop, Timer
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.dashboard import Dashboard, DashboardServer
from sim_backend.ur10.faults import UrFaults
from sim_backend.ur10.models import UR10, UrModel, Version
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.rtde_server import RtdeServer
from sim_backend.ur10.script_server import script_servers
from sim_backend.ur10.tcp import TcpServer
from sim_backend.world.plant import ArmSource, FtSource

REAL_CLOCK = 0.99992
"""What an outside clock makes of a controller's rate."""
RESYNC_AFTER_NS = NS_PER_S


class UrEmulator(UrFaults):
    """An emulated UR arm at `host` (127.x.y.z), serving as soon as its loop runs.

    `rate_hz` is the control cycle measured by an outside clock (a real one is never exactly 125 or 500 Hz; None: as
    one is); `phase` (0..1) shifts its grid; `version` is another PolyScope than the model's;
    `wrench` feeds the sensor at the flange, which only an e-Series arm has. The fault methods are
    those of `UrFaults`; `requests` and `counters` record what happened.
    Raises EnvironmentFault when a port is taken, UsageError for an address that is not loopback.
    """

    def __init__(
        self,
        loop: EventLoop,
        source: ArmSource,
        *,
        host: str = "127.0.0.10",
        model: UrModel = UR10,
        rate_hz: float | None = None,
        phase: float = 0.21,
        version: Version | None = None,
        programs: tuple[str, ...] = ("/programs/other.urp",),
        power_step_s: float = 1.0,
        wrench: FtSource | None = None,
    ) -> None:
        self.host = host
        self.requests = RequestLog()
        self.controller = UrController(source, model, monotonic_ns(), power_step_s, wrench)
        self.controller.version = version or model.version
        self._loop = loop
        self._period_ns = NS_PER_S / (rate_hz or model.rate_hz * REAL_CLOCK)
        self._start_ns = monotonic_ns() + round(phase * self._period_ns)
        self._cycle = 0
        self._timer: Timer | None = None
        self.late_cycles = 0
        self.resyncs = 0
        opened: list[TcpServer] = []
        try:
            self.rtde = RtdeServer(loop, host, self.controller, self.requests)
            opened.append(self.rtde)
            self.dashboard = DashboardServer(loop, host, Dashboard(self.controller, programs), self.requests)
            opened.append(self.dashboard)
            self.scripts = script_servers(loop, host, self.controller, self.requests)
        except BaseException:
            for server in opened:
                server.close()
            raise
        self._schedule()

    @property
    def counters(self) -> dict[str, int]:
        """Counts since the start, by name."""
        return {
            **self.controller.counters,
            **self.rtde.counters,
            "rtde_clients": len(self.rtde.clients),
            "rtde_accepted": self.rtde.accepted,
            "dashboard_accepted": self.dashboard.accepted,
            "script_accepted": sum(server.accepted for server in self.scripts),
            "input_frames": self.requests.input_frames,
            "bad_frames": self.requests.bad_frames,
            "late_cycles": self.late_cycles,
            "resyncs": self.resyncs,
        }

    def close(self) -> None:
        """Close every port and connection; idempotent. The loop stays."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        for server in self._servers():
            server.close()

    def _schedule(self) -> None:
        self._cycle += 1
        at_ns = self._start_ns + round(self._cycle * self._period_ns)
        self._timer = self._loop.call_at(at_ns, self._run_cycle)

    def _run_cycle(self, grid_ns: int) -> None:
        late_ns = monotonic_ns() - grid_ns
        if late_ns > self._period_ns:
            self.late_cycles += 1
            self.rtde.read_now()  # a stall of this process must not be mistaken for silence of the clients
        if late_ns > RESYNC_AFTER_NS:
            self.resyncs += 1
            self._cycle += int(late_ns / self._period_ns)
        self.controller.cycle(grid_ns)
        self.rtde.send_data()
        if self._timer is not None:
            self._schedule()
