"""The gate's real process between a control that the test plays and an emulated base: what the safety page promises.

Nothing here knows how the gate is made: frames go in, velocities come out, and the gate's own log says when.
The numbers are those of docs/safety.md, docs/how-it-works.md and docs/decisions/0005.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import pytest

from robot_io.ipc.gate_link import GateLink
from robot_io.ipc.ring import Ring
from robot_io.ipc.spawn import Child, spawn
from robot_io.log.channels import CHANNELS, Kind
from robot_io.messages import BodyTwist
from robot_io.tick import Mode
from safety.gate_process import GateJob
from tests.host_watch import HostStalled, HostWatch, repeated_when_the_host_stalls
from tests.wire.bridge_process import Bridge, running_bridge, until

MS = 1_000_000
ZERO, SLOW, TOO_FAST = BodyTwist(), BodyTwist(0.004, 0.0, 0.0), BodyTwist(0.2, 0.0, 0.0)
LIMITS = {
    "speed": 0.15, "turn_rate": 0.25, "acceleration": 0.5, "turn_acceleration": 1.0, "period_ns": 10 * MS,
    "contact_x": 0.0, "contact_y": 0.0,
}  # fmt: skip
UNTURNED = {"base_from_sensor": ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "contact_in_base_m": (0, 0, 0)}
OFTEN_MS = 40.0
"""The base stops by itself 250 ms after a command; it takes one at each of its ticks."""
RECORD_BYTES = 65_536
"""More than the record needs."""


class Gate:
    """A gate at work; the test is its control. Times are CLOCK_MONOTONIC ns."""

    def __init__(self, url: str) -> None:
        control, gate_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        record_fd = os.memfd_create("record", os.MFD_CLOEXEC)
        os.ftruncate(record_fd, RECORD_BYTES)
        self._ring = Ring.create("gate", 1 << 20)
        launcher_fd, self._launcher = os.pipe()
        fds = [gate_end.fileno(), record_fd, self._ring.fd, launcher_fd]
        job = {
            "base": {"url": url},
            "frames": {**UNTURNED, "sensor_in_base_m": (0, 0, 0)},
            "kind_folder": "",
            "limits": LIMITS,
            "bounds": {"distance_m": 2.0, "moving_s": 30.0},
            **dict(zip(("control_fd", "record_fd", "ring_fd", "launcher_fd"), fds, strict=True)),
            "status_fd": -1,
            "wall_offset_ns": 0,
        }
        self.child: Child = spawn("gate", "safety.gate_process", msgspec.convert(job, GateJob), fds)
        gate_end.close()
        os.close(launcher_fd)
        self.link = GateLink(control, record_fd)
        self.told = 0
        """How many frames it was sent."""
        self._frame_ns = 0

    def wait_ready(self) -> None:
        def ready() -> bool:
            self.child.hear()
            return self.child.ready is not None

        assert until(ready), self.child.errors or self.child.last_stderr_line()

    def tell(self, twist: BodyTwist) -> None:
        """Send a frame; raise HostStalled where the test was held up, so that the gate may take it for silent."""
        now_ns = time.monotonic_ns()
        if self._frame_ns and now_ns - self._frame_ns > 40 * MS:
            raise HostStalled(f"control was held up for {(now_ns - self._frame_ns) / MS:.0f} ms")
        self._frame_ns = now_ns
        self.told += 1
        self.link.command(twist, tick=self.told, mode=int(Mode.PUSHING))

    def tell_until(self, twist: BodyTwist, condition: Callable[[], bool]) -> None:
        """Command `twist` every 10 ms, as control does, until the condition holds."""

        def tell() -> bool:
            if time.monotonic_ns() >= self._frame_ns + 10 * MS:
                self.tell(twist)
            return condition()

        assert until(tell, every_s=0.001)

    def tell_for(self, twist: BodyTwist, time_ms: float) -> None:
        end_ns = time.monotonic_ns() + time_ms * MS
        self.tell_until(twist, lambda: time.monotonic_ns() >= end_ns)

    def hang_up(self) -> None:
        """End as control does, and wait for the gate's end."""
        self.link.close()
        assert until(lambda: self.child.process.poll() is not None), "the gate did not end"
        assert self.child.process.returncode == 0, self.child.last_stderr_line()
        self.child.hear()

    def log(self) -> tuple[list[int], list[tuple[int, BodyTwist]]]:
        """Return when it latched, and what it sent when: from its log, which is emptied."""
        latched, sent = [], []
        for record in self._ring.pop_all():
            if record.kind == Kind.GATE_DECISION:
                latched.append(record.time_ns)
            elif record.kind == Kind.GATE_SENT:
                value: Any = CHANNELS[Kind.GATE_SENT].cdr_type.decode(record.payload)
                twist = value.twist
                sent.append((record.time_ns, BodyTwist(twist.linear.x, twist.linear.y, twist.angular.z)))
        return latched, sent

    def lose_launcher(self) -> None:
        """End as the launcher does that is killed."""
        if self._launcher >= 0:
            os.close(self._launcher)
            self._launcher = -1

    def close(self) -> None:
        self.link.close()
        self.lose_launcher()
        self.child.end(3.0)
        self.child.close()
        self._ring.close()


@contextlib.contextmanager
def running_gate(bridge: Bridge) -> Iterator[Gate]:
    with contextlib.closing(Gate(bridge.url)) as gate:
        gate.wait_ready()
        yield gate


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    with running_bridge() as running:
        yield running


def blame_the_host(host: HostWatch, since_ns: int) -> None:
    """Raise HostStalled where a process has waited for its processor for more than 10 ms since then."""
    stall_ms = host.worst_wait_ms(since_ns, time.monotonic_ns())
    if stall_ms > 10.0:
        raise HostStalled(f"a process waited for its processor for {stall_ms:.0f} ms")


def check_last_zeros(gate: Gate, host: HostWatch, least_ms: float, most_ms: float) -> None:
    """Check that from the end of control on, as the gate saw it, zeros alone go on for a time between these bounds."""
    (end_ns,), sent = gate.log()
    last = [(t_ns, twist) for t_ns, twist in sent if t_ns >= end_ns]
    assert {twist for _, twist in last} == {ZERO}
    zeros = [(t_ns - end_ns) / MS for t_ns, _ in last]
    longest_ms = max(b - a for a, b in itertools.pairwise([0.0, *zeros]))
    kept = least_ms <= zeros[-1] <= most_ms and longest_ms < OFTEN_MS
    stall_ms = host.worst_ms(end_ns, time.monotonic_ns())
    if not kept and stall_ms > 10.0:
        raise HostStalled(f"a processor stood still for {stall_ms:.0f} ms")
    assert kept, (
        f"the last after {zeros[-1]:.0f} ms, not {least_ms:g} to {most_ms:g}; one came {longest_ms:.0f} ms late"
    )


@repeated_when_the_host_stalls
def test_zeros_go_on_for_half_a_second_at_most_while_the_base_moves(tmp_path, host, bridge):
    """A joystick drives the base all the while: it never comes to rest."""
    with running_gate(bridge) as gate:
        bridge.do("joystick", BodyTwist(0.05, 0.0, 0.0), 4.0)
        gate.tell_until(ZERO, lambda: gate.link.read().odometry.vx > 0.04)
        gate.hang_up()
        check_last_zeros(gate, host, 400.0, 510.0)  # half a second, and a tick of 10 ms


@repeated_when_the_host_stalls
def test_a_base_that_still_reads_rest_is_not_yet_believed(tmp_path, host, bridge):
    """Control dies right after its first velocity: no wheel has turned, and that velocity still is on its way.

    The base takes a command at its next tick of 40 ms, and its odometry shows it a tick later.
    """
    with running_gate(bridge) as gate:
        gate.tell_for(ZERO, 100)
        gate.tell(SLOW)
        gate.hang_up()
        check_last_zeros(gate, host, 80.0, 400.0)  # two ticks, and no half second for a base that rests


@repeated_when_the_host_stalls
def test_a_killed_launcher_ends_motion_before_the_kernel_has_killed_control(tmp_path, host, bridge):
    with running_gate(bridge) as gate:
        gate.tell_for(ZERO, 100)
        gate.tell_for(SLOW, 100)
        gone_ns = time.monotonic_ns()
        gate.lose_launcher()
        assert until(lambda: gate.child.process.poll() is not None), "the gate did not end"
        latched_ns, sent = gate.log()
    if latched_ns[0] < gone_ns:  # silent for 50 ms, said the gate
        blame_the_host(host, gone_ns - 200 * MS)
    assert SLOW in {twist for _, twist in sent}
    first_zero_ms = (next(t_ns for t_ns, twist in sent if t_ns >= gone_ns and twist == ZERO) - gone_ns) / MS
    if first_zero_ms > 5.0:
        blame_the_host(host, gone_ns)
    assert first_zero_ms <= 5.0  # it waits for nothing but its processor
    assert {twist for t_ns, twist in sent if t_ns >= gone_ns + 5 * MS} == {ZERO}


@repeated_when_the_host_stalls
def test_the_last_words_to_the_base_are_zero_three_times(tmp_path, host, bridge):
    began_ns = time.monotonic_ns()
    with running_gate(bridge) as gate:
        gate.tell_for(ZERO, 100)
        gate.tell_for(SLOW, 100)
        left_ns = time.monotonic_ns()
        gate.hang_up()
        latched_ns, sent = gate.log()
    if latched_ns[0] < left_ns:  # silent for 50 ms, said the gate
        blame_the_host(host, began_ns)
    assert SLOW in {twist for _, twist in sent}
    assert until(lambda: not bridge.report()["clients"])
    began_ns = sent[0][0]  # before, it has proved with zeros that they arrive
    heard = [twist for t_ns, *twist in bridge.heard() if t_ns >= began_ns]
    assert len(heard) == len(sent) + 3, "more than the repeats in its log"
    assert heard[-3:] == [[0.0, 0.0, 0.0]] * 3


@repeated_when_the_host_stalls
def test_a_gate_held_up_for_less_than_100_ms_takes_no_frame_that_waited_for_silence(tmp_path, host, bridge):
    """Longer than the 50 ms of silence that latch it; everything is drained before anything is judged."""
    longest_pause_ms, first_ns = 0.0, time.monotonic_ns()
    with running_gate(bridge) as gate:
        gate.tell_for(ZERO, 50)
        for _ in range(8):
            gate.tell_for(SLOW, 50)
            began_ns = time.monotonic_ns()
            gate.child.process.send_signal(signal.SIGSTOP)
            gate.tell_for(SLOW, 70)
            gate.child.process.send_signal(signal.SIGCONT)
            longest_pause_ms = max(longest_pause_ms, (time.monotonic_ns() - began_ns) / MS)
        gate.tell_for(SLOW, 50)
        record = gate.link.read()
    if record.latched and longest_pause_ms > 90.0:
        raise HostStalled(f"the gate was held up for {longest_pause_ms:.0f} ms")
    if record.latched:
        blame_the_host(host, first_ns)
    assert (record.latched, record.latch_cause) == (False, 0)
    assert record.sent == SLOW


@pytest.mark.parametrize("after", ["refused", "and what came after it"])
@repeated_when_the_host_stalls
def test_a_frame_that_was_refused_never_counts_as_accepted(after, tmp_path, bridge):
    with running_gate(bridge) as gate:
        gate.tell_for(ZERO, 50)
        good = gate.told
        assert until(lambda: gate.link.read().accepted_seq == good, every_s=0.001)
        gate.tell(TOO_FAST)
        assert until(lambda: gate.link.read().latched, every_s=0.001)
        if after != "refused":
            published_ns = gate.link.read().published_ns
            gate.tell_for(ZERO, 50)
            assert until(lambda: gate.link.read().published_ns > published_ns + 50 * MS)
        record = gate.link.read()
    assert record.verdict != 0
    assert record.accepted_seq == good
