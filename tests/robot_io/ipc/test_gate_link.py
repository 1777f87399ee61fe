"""Control's end of the link to the gate: one frame a tick, one record back, and never in the loop's way."""

import os
import socket

import pytest

from robot_io.clock import VirtualClock
from robot_io.ipc.gate_frame import GateFrame, unpack_frame
from robot_io.ipc.gate_link import GateLink
from robot_io.ipc.record import BASE_RECORD, TypedRecord
from robot_io.messages import NO_BASE, BaseRecord, BaseStatus, BodyTwist, Pose2D

TWIST = BodyTwist(0.1, 0.01, -0.02)


class Link:
    """A link and its far ends, as the gate would hold them."""

    def __init__(self, clock=None):
        self.gate, mine = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.gate.setblocking(False)
        self.record = TypedRecord.create("test-base", BASE_RECORD)
        self.base = GateLink(mine, os.dup(self.record.fd), *([clock] if clock else []))

    def close(self):
        self.base.close()
        self.gate.close()
        self.record.close()


@pytest.fixture
def link():
    made = Link(VirtualClock(777))
    yield made
    made.close()


def test_frames_are_numbered_from_one_without_a_gap_and_stamped(link):
    for n in range(1, 6):
        link.base.command(TWIST, tick=n * 10, mode=2)
        assert unpack_frame(link.gate.recv(1000)) == GateFrame(n, n * 10, 777, 2, TWIST)
    assert link.base.alive


def test_each_frame_is_one_message(link):
    link.base.command(TWIST, tick=1, mode=2)
    link.base.command(TWIST, tick=2, mode=2)
    assert unpack_frame(link.gate.recv(1000)).seq == 1
    assert unpack_frame(link.gate.recv(1000)).seq == 2
    with pytest.raises(BlockingIOError):
        link.gate.recv(1000)


def test_a_gate_that_is_gone_is_noticed_and_nothing_is_raised(link):
    link.gate.close()
    link.base.command(TWIST, tick=1, mode=2)
    assert not link.base.alive
    link.base.command(TWIST, tick=2, mode=2)
    assert not link.base.alive


def test_a_gate_that_does_not_read_is_noticed_without_waiting(link):
    for tick in range(100_000):
        link.base.command(TWIST, tick=tick, mode=2)
        if not link.base.alive:
            break
    assert 10 < tick < 99_999
    assert unpack_frame(link.gate.recv(1000)).seq == 1  # what was sent before is still there, whole


def test_the_record_is_the_newest_and_nobody_before_the_first(link):
    assert link.base.read() == NO_BASE
    record = BaseRecord(
        pose=Pose2D(1.0, 2.0, 0.5), pose_valid=True, pose_received_ns=5, pose_seq=6, odometry=TWIST,
        odometry_received_ns=7, odometry_seq=8, status=BaseStatus(False, True, 26.5), status_received_ns=9,
        newest_inbound_ns=10, newest_pong_ns=11, accepted_seq=12, verdict=3, sent=TWIST, sent_ns=13, latched=True,
        latch_cause=11, published_ns=14, object_pose=Pose2D(3.0, 4.0, 0.25),
    )  # fmt: skip
    link.record.publish(NO_BASE)
    link.record.publish(record)
    assert link.base.read() == record


def test_closing_is_the_end_of_file_for_the_gate_and_may_be_done_twice(link):
    link.base.command(TWIST, tick=1, mode=2)
    link.base.close()
    link.base.close()
    assert len(link.gate.recv(1000)) == 60
    assert link.gate.recv(1000) == b""


def test_the_default_clock_is_the_monotonic_one():
    from robot_io.clock import monotonic_ns

    link = Link()
    before = monotonic_ns()
    link.base.command(TWIST, tick=1, mode=2)
    assert before <= unpack_frame(link.gate.recv(1000)).sent_ns <= monotonic_ns()
    link.close()
