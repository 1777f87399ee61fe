"""The gate's process around its shell, one handler at a time, with a base that only writes down what it is told."""

import os
import socket
from collections.abc import Iterator

import pytest

from robot_io.clock import VirtualClock
from robot_io.ipc.gate_frame import GateFrame, pack_frame
from robot_io.ipc.record import BASE_RECORD, TypedRecord
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from robot_io.log.channels import Kind
from robot_io.messages import BaseFeed, BaseOdometry, BaseRecord, BodyTwist, DeviceHealth, LinkState, Stamped
from robot_io.rig.config import BaseConfig, FramesConfig
from safety import gate_process
from safety.envelope import EnvelopeLimits
from safety.gate import Latch
from safety.gate_process import GateJob, GateProcess
from safety.motion_bounds import TravelLimits

LIMITS = EnvelopeLimits(0.15, 0.25, 0.5, 1.0, 10_000_000, 0.0, 0.0)
FRAMES = FramesConfig(((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0, 0, 0), (0, 0, 0))
SLOW, ZERO = BodyTwist(0.005, 0.0, 0.0), BodyTwist()
MS = 1_000_000


class Base:
    """Stands in for the driver."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self.told: list[BodyTwist] = []
        self.arrived: list[Stamped[BaseFeed]] = []
        self.link = LinkState.UP
        self.sent_ns = self.newest_inbound_ns = self.newest_pong_ns = 0

    def drain(self) -> tuple[Stamped[BaseFeed], ...]:
        arrived, self.arrived = tuple(self.arrived), []
        return arrived

    def command(self, wanted: BodyTwist) -> BodyTwist:
        if self.link != LinkState.UP:
            return ZERO
        self.told.append(wanted)
        self.sent_ns = self._clock()
        return wanted

    def health(self) -> DeviceHealth:
        return DeviceHealth(self.link, "pulled out" if self.link == LinkState.LOST else "", {}, 0.0)


class Rig:
    """A gate whose handlers are called by the test at times of its own; `control` is the other end of its socket."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock = clock
        self.control, gate_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.record_out = TypedRecord.create("record", BASE_RECORD)
        self.ring = Ring.create("gate", 1 << 16)
        self.base = Base(self.clock)
        self.status, status = os.pipe()
        self.launcher, self.launcher_end = os.pipe()
        job = GateJob(
            BaseConfig(),
            FRAMES,
            "",
            LIMITS,
            TravelLimits(2.0, 30.0),
            gate_end.detach(),
            self.record_out.fd,
            self.ring.fd,
            self.launcher,
            status,
            wall_offset_ns=0,
        )
        self.gate = GateProcess(job, self.base, StatusPipe(status))  # type: ignore[arg-type]
        self.seq = 0

    def frame(self, twist: BodyTwist) -> None:
        self.seq += 1
        self.control.send(pack_frame(GateFrame(self.seq, self.seq, self.clock(), 2, twist)))

    def wait_ms(self, time_ms: int) -> None:
        self.clock.advance_to(self.clock() + time_ms * MS)

    def record(self) -> BaseRecord:
        found = self.record_out.read()
        assert found is not None
        return found[1]

    def logged(self, kind: Kind) -> int:
        return sum(record.kind == kind for record in self.ring.pop_all())


@pytest.fixture
def rig(monkeypatch) -> Iterator[Rig]:
    clock = VirtualClock(1_000 * MS)
    monkeypatch.setattr(gate_process, "monotonic_ns", clock)
    rig = Rig(clock)
    yield rig
    rig.gate._loop.close()
    rig.gate._control.close()
    rig.gate._record_out.close()
    rig.control.close()
    rig.ring.close()
    os.close(rig.status)
    os.close(rig.launcher)
    os.close(rig.launcher_end)
    os.close(rig.gate._status._fd)


@pytest.mark.parametrize("wake", ["_on_control", "_on_base", "_on_clock"])
def test_a_gate_that_was_frozen_lets_nothing_out_whatever_wakes_it_first(rig, wake):
    rig.frame(SLOW)
    rig.gate._on_control(0)
    assert rig.base.told == [SLOW]
    for _ in range(3):
        rig.wait_ms(33)
        rig.frame(SLOW)
    rig.wait_ms(2)
    getattr(rig.gate, wake)(0)
    assert rig.base.told[1:] == [ZERO]
    assert rig.record().latch_cause == Latch.PAUSED


@pytest.mark.parametrize("wake", ["_on_control", "_on_base", "_on_clock"])
def test_after_a_suspend_nothing_leaves_but_zero_whatever_wakes_it_first(rig, wake, monkeypatch):
    """The clock that all ages are taken from stood still: the waiting frame looks fresh."""
    asleep = [5 * MS]
    monkeypatch.setattr(gate_process, "asleep_ns", lambda: asleep[0])
    rig.frame(SLOW)
    rig.gate._on_control(0)
    assert rig.base.told == [SLOW]
    asleep[0] += 3_600_000 * MS
    rig.wait_ms(10)
    rig.frame(BodyTwist(0.002, 0.0, 0.0))
    getattr(rig.gate, wake)(0)
    assert rig.base.told[1:] == [ZERO]
    assert rig.record().latch_cause == Latch.SUSPENDED


def test_a_pause_while_frames_are_read_is_no_silence_of_control(rig, monkeypatch):
    """It falls between the look at the clock and the first frame, and seven frames come meanwhile."""
    rig.frame(SLOW)
    rig.gate._on_control(0)
    began_ns = rig.clock()
    for n in range(7):
        sent_ns = began_ns + (n + 1) * 10 * MS
        rig.control.send(pack_frame(GateFrame(2 + n, 2 + n, sent_ns, 2, SLOW)))
    looks = iter([began_ns])
    monkeypatch.setattr(gate_process, "monotonic_ns", lambda: next(looks, began_ns + 70 * MS))
    rig.gate._on_control(0)
    monkeypatch.setattr(gate_process, "monotonic_ns", lambda: began_ns + 72 * MS)
    rig.gate._on_clock(0)
    record = rig.record()
    assert (record.latched, record.accepted_seq) == (False, 8)


def test_over_a_lost_link_nothing_counts_as_sent(rig):
    rig.frame(SLOW)
    rig.gate._on_control(0)
    assert rig.logged(Kind.GATE_SENT) == 1
    sent_ns = rig.record().sent_ns
    rig.base.link = LinkState.LOST
    rig.gate._on_clock(0)
    assert rig.record().latch_cause == Latch.LINK
    assert rig.logged(Kind.GATE_SENT) == 0
    assert (rig.record().sent, rig.record().sent_ns) == (SLOW, sent_ns)


@pytest.mark.parametrize(
    ("measured", "ends"),
    [
        (ZERO, True),
        (BodyTwist(0.01, 0.0, 0.0), False),
        (BodyTwist(0.0, -0.01, 0.0), False),
        (BodyTwist(omega=0.01), False),
    ],
)
def test_the_last_zeros_go_on_until_the_base_rests(rig, measured, ends):
    rig.gate._loop.add_fd(rig.gate._control.fileno(), rig.gate._on_control)
    rig.frame(SLOW)
    rig.gate._on_control(0)
    rig.control.close()
    rig.gate._on_control(0)
    stopped: list[bool] = []
    rig.gate._loop.stop = lambda: stopped.append(True)
    rig.wait_ms(130)
    rig.base.arrived.append(Stamped(BaseOdometry(measured), 0, rig.clock(), 0.0))
    rig.gate._on_clock(0)
    assert bool(stopped) == ends
    rig.wait_ms(369)
    rig.gate._on_clock(0)
    assert bool(stopped) == ends
    rig.wait_ms(1)  # half a second is over
    rig.gate._on_clock(0)
    assert stopped
    assert set(rig.base.told[1:]) == {ZERO}
