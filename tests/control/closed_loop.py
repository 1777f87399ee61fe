"""The real core folded against the real world by hand: no driver, no byte, a virtual clock.

Samples are taken on the sensor's own grid and arrive when a line of the given rate, delay and burst delivers them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import ArmRecord, BaseRecord, BaseStatus, BodyTwist, JointState
from robot_io.tick import FtInput, FtReading, HostInput, Operator, TickInput, TickOutput, TickState
from safety import gate
from safety.gate import GateState
from sim_backend.world.world import World
from tools.rig import resolve_rig
from tools.run.tick_core import TickCore

START_NS = 1_000_000_000
PERIOD_NS = 10_000_000
LINK_UP = 2


class ClosedLoop:
    """One push, tick by tick. `state`, `output` and `world` are those after the newest tick.

    Pose and odometry are the world's own, without noise, and the wheels do not slip.
    """

    def __init__(
        self,
        overrides: tuple[str, ...] = (),
        seed: int = 0,
        *,
        ft_rate_hz: float = 100.0,
        ft_delay_ms: float = 0.0,
        ft_burst_ms: int = 0,
        counts: bool = True,
        world: World | None = None,
    ) -> None:
        self.rig = resolve_rig("sim", ("world.slip=0", *overrides))
        self.core = TickCore.of(self.rig)
        self.world = world or World(self.rig, seed, START_NS)
        self.state = TickState()
        self.output: TickOutput | None = None
        self.tick = 0
        self.operator = Operator.NONE
        self.paused = False
        self.gate = GateState()
        self._gate_limits = self.core.safety.envelope
        self._ft_period_ns = 1e9 / ft_rate_hz
        self._ft_delay_ns = round(ft_delay_ms * 1e6)
        self._ft_burst_ns = ft_burst_ms * 1_000_000
        self._counts = counts
        self._samples = 0
        self._on_the_line: deque[FtReading] = deque()
        self._arrived = 0
        self._sent = BodyTwist()
        self._odometry = (BodyTwist(), 0, 0)
        self._faults_seen: dict[str, int] = {}

    @property
    def faults_seen(self) -> dict[str, int]:
        """Every fault so far, with the tick of its first appearance."""
        return self._faults_seen

    def step(self) -> TickOutput:
        """Run one tick."""
        now_ns = START_NS + self.tick * PERIOD_NS
        self.state, self.output = self.core.fold(self.state, self._input(now_ns))
        for fault in self.output.faults:
            self._faults_seen.setdefault(fault, self.tick)
        self._pass_through_gate(now_ns)
        self.tick += 1
        return self.output

    def run(self, on_tick: Callable[[ClosedLoop], object] | None = None, most_ticks: int = 30_000) -> TickOutput:
        """Run until the core says finished, or until `on_tick` returns True."""
        for _ in range(most_ticks):
            output = self.step()
            if output.finished or (on_tick is not None and on_tick(self) is True):
                return output
        raise AssertionError(f"not finished after {most_ticks} ticks: {self.state.control}")

    def _pass_through_gate(self, now_ns: int) -> None:
        frame = GateFrame(self.gate.seq + 1, self.tick, now_ns, self.output.mode, self.output.command_body)
        self.gate = gate.on_clock(gate.on_frame(self._gate_limits, self.gate, frame, now_ns), now_ns)
        assert not self.gate.latch, (self.tick, self.gate)
        wanted = gate.due(self._gate_limits, self.gate, now_ns)
        if wanted is not None:
            self.world.command_base(wanted, now_ns)
            self.gate = gate.sent(self.gate, wanted, now_ns)
            self._sent = wanted

    def _input(self, now_ns: int) -> TickInput:
        readings = self._readings(now_ns)
        truth = self.world.read_base(now_ns)
        if self.tick % 2 == 0:
            self._odometry = (truth.twist, now_ns, self._odometry[2] + 1)
            self.gate = gate.on_speed(self._gate_limits, self.gate, truth.twist)
        count = self.tick + 1
        joints = JointState(self.rig.arm.held_pose_rad, (0.0,) * 6, 1, 0, self.tick * 0.01)
        operator, self.operator = self.operator, Operator.NONE
        return TickInput(
            self.tick,
            now_ns,
            int(operator),
            HostInput(0, 0, True, True, True, False, 0),
            FtInput(readings, LINK_UP, self._arrived, 0, 0),
            ArmRecord(joints, count, now_ns, now_ns, LINK_UP),
            BaseRecord(
                pose=truth.pose,
                pose_valid=True,
                pose_received_ns=now_ns,
                pose_seq=count,
                odometry=self._odometry[0],
                odometry_received_ns=self._odometry[1],
                odometry_seq=self._odometry[2],
                status=BaseStatus(False, True, 26.0),
                status_received_ns=now_ns,
                newest_inbound_ns=now_ns,
                sent=self._sent,
                published_ns=now_ns,
            ),
            self.paused,
        )

    def _readings(self, now_ns: int) -> tuple[FtReading, ...]:
        while (sample_ns := START_NS + round(self._samples * self._ft_period_ns)) <= now_ns:
            arrival_ns = sample_ns + self._ft_delay_ns
            if self._ft_burst_ns:
                arrival_ns = START_NS + -(-(arrival_ns - START_NS) // self._ft_burst_ns) * self._ft_burst_ns
            values = self.world.read_ft(sample_ns)
            if self._counts:
                values = tuple(round(v, 2 if i < 3 else 3) for i, v in enumerate(values))
            self._samples += 1
            # The driver back-dates the packets of a burst to when each would have come by itself.
            self._on_the_line.append(FtReading(arrival_ns, self._samples, values[:3], values[3:]))
        arrived = []
        while self._on_the_line and self._on_the_line[0].received_ns <= now_ns:
            reading = self._on_the_line.popleft()
            arrived.append(reading)
        self._arrived += len(arrived)
        if self._ft_burst_ns:
            newest = arrived[-1].received_ns if arrived else 0
            spread = round(self._ft_period_ns)
            arrived = [
                FtReading(newest - (len(arrived) - 1 - i) * spread, r.seq, r.force, r.torque)
                for i, r in enumerate(arrived)
            ]
        return tuple(arrived)
