"""The recorder as a process: kills of the producer, signals, a full disk, a frozen second producer, damaged rings."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import subprocess
import sys
import time
import zlib
from pathlib import Path

import pytest
from mcap.records import Message as McapMessage
from rosbags.highlevel import AnyReader

from robot_io.errors import LogDamaged
from robot_io.ipc.ring import Ring
from robot_io.log.chain import TickChain
from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.recovery import recover
from robot_io.log.ros_messages import LOG, Log, ros_time
from robot_io.mcap.read import read_log, read_summary
from robot_io.mcap.walk import Topic, walk
from robot_io.messages import ArmRecord, BaseRecord, BodyTwist, Pose2D, WorldTwist
from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.tick import (
    TICK_CDR,
    ControlTick,
    FtInput,
    FtReading,
    HostInput,
    SafetyState,
    TickInput,
    TickOutput,
    TickState,
)

OFFSET_NS = 1_700_000_000 * 10**9
CONFIG = rig_to_toml(load_rig("emulated"))

# A producer as control is one: a ring, the write end of a pipe that nobody else holds, a tick each 2 ms.
PRODUCER = """
import json, sys, time
from robot_io.log.channels import Kind
from robot_io.ipc.ring import Ring
ring = Ring(int(sys.argv[1]))
for n, payload in enumerate(json.load(open(sys.argv[2]))):
    if ring.push(Kind.CONTROL_TICK, n * 10_000_000, bytes.fromhex(payload)):
        print(n, flush=True)
    time.sleep(0.002)
"""


def tick_payload(n: int) -> bytes:
    now_ns = n * 10_000_000
    reading = FtReading(now_ns - 1_000_000, n, (n * 0.5, 1.0, -2.0), (0.1, 0.2, 0.3))
    inp = TickInput(
        n,
        now_ns,
        0,
        HostInput(90_000, 0, True, True, True, False, 0),
        FtInput((reading,), 2, n, 0, 0),
        ArmRecord(packets=n + 1, changed_ns=now_ns - 2_000_000, link=2),
        BaseRecord(
            pose=Pose2D(n * 0.001, 0.25, 0.5), pose_valid=True, pose_seq=n + 1, pose_received_ns=now_ns - 3_000_000
        ),
    )
    before, after = TickState(), TickState(safety=SafetyState(mode=2 if n == 0 else 0))
    faults = ("F60-late",) if n % 50 == 10 else ()
    out = TickOutput(2, faults, WorldTwist(), BodyTwist(0.2, 0.0, 0.0), BodyTwist(0.1, 0.0, 0.0), 0.0, 0.0, False, 0)
    return TICK_CDR.encode(ControlTick(0, 0, inp, (before,), after, out))


class Run:
    """A recorder with its rings and pipes, as the launcher sets it up."""

    def __init__(
        self, out: Path, names: tuple[str, ...] = ("control", "gate"), capacity: int = 1 << 22, config: str = CONFIG
    ) -> None:
        self.out = out
        self.rings = {name: Ring.create(name, capacity) for name in names}
        pipes = [os.pipe() for _ in names]
        self.alive = {name: pipe[1] for name, pipe in zip(names, pipes, strict=True)}
        self.status, status_write = os.pipe()
        ends = [pipe[0] for pipe in pipes]
        job = {
            "out_path": str(out),
            "config_text": config,
            "metadata": {"seed": "4"},
            "wall_offset_ns": OFFSET_NS,
            "rings": [{"name": name, "fd": ring.fd} for name, ring in self.rings.items()],
            "alive_fds": ends,
            "status_fd": status_write,
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tools.run.recorder"],
            stdin=subprocess.PIPE,
            pass_fds=[*ends, status_write, *(ring.fd for ring in self.rings.values())],
        )
        self.process.stdin.write(json.dumps(job).encode() + b"\n")
        self.process.stdin.close()
        for end in (*ends, status_write):
            os.close(end)
        self._pending = b""

    def event(self, timeout_s: float = 20.0) -> dict:
        deadline = time.monotonic() + timeout_s
        while b"\n" not in self._pending:
            assert select.select([self.status], [], [], max(0.0, deadline - time.monotonic()))[0], "no event in time"
            chunk = os.read(self.status, 65536)
            assert chunk, "the recorder ended without a word"
            self._pending += chunk
        line, _, self._pending = self._pending.partition(b"\n")
        return json.loads(line)

    def gone(self, name: str) -> None:
        os.close(self.alive.pop(name))

    def finished(self) -> dict:
        for name in tuple(self.alive):
            self.gone(name)
        event = self.event()
        assert self.process.wait(10) == 0
        return event

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for fd in (*self.alive.values(), self.status):
            os.close(fd)
        for ring in self.rings.values():
            ring.close()


@pytest.fixture
def run(tmp_path):
    run = Run(tmp_path / "run.mcap")
    assert run.event() == {"event": "ready", "path": str(run.out)}
    yield run
    run.close()


def ticks_of(path: Path) -> list[int]:
    chain, numbers = TickChain(), []
    for message in read_log(path):
        if message.topic == "/control/tick":
            assert chain.holds(message.payload)
            numbers.append(TICK_CDR.decode(message.payload).input.tick)
    return numbers


def wait_for(condition, timeout_s: float = 20.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.005)


def test_what_was_pushed_is_in_the_log_with_what_is_derived_from_it(run):
    for n in range(120):
        assert run.rings["control"].push(Kind.CONTROL_TICK, n * 10_000_000, tick_payload(n))
    line = LOG.encode(Log(ros_time(OFFSET_NS), 20, "gate", "hello", "", "", 0))
    run.rings["gate"].push(Kind.ROSOUT, 5_000_000, line)
    done = run.finished()
    assert done["event"] == "finished"
    assert done["complete"]
    assert done["records"] == {"control": 120, "gate": 1}
    assert done["dropped"] == {"control": 0, "gate": 0}
    assert done["lost"] == 0
    assert ticks_of(run.out) == list(range(120))
    summary = read_summary(run.out)
    counts = {channel.topic: channel.messages for channel in summary.channels}
    assert done["messages"] == summary.messages == sum(counts.values())
    assert counts == {
        "/robot_description": 1,
        "/tf_static": 1,
        "/path": 1,
        "/control/tick": 120,
        "/ft/wrench_raw": 120,
        "/ft/wrench": 120,
        "/base/cmd_vel_raw": 120,
        "/base/cmd_vel": 120,
        "/loop/timing": 2,  # one a second
        "/arm/joint_states": 120,
        "/arm/status": 3,  # one a second of its own time, which begins before the first tick
        "/control/signals": 120,
        "/tf": 120,
        "/diagnostics": 2,
        "/safety/event": 1 + 2 * 3,  # one mode, three faults that come and go
        "/rosout": 1 + 7,
    }
    assert {channel.topic for channel in summary.channels if channel.latched} == {
        "/robot_description",
        "/path",
        "/tf_static",
    }
    end = summary.metadata["run_end"]
    payloads = [m.payload for m in read_log(run.out) if m.topic == "/control/tick"]
    assert end["last_tick_crc32"] == f"{zlib.crc32(payloads[-1]):08x}"
    assert (end["ticks"], end["records_gate"], end["dropped_control"]) == ("120", "1", "0")
    assert summary.metadata["run"] == {"seed": "4", "wall_offset_ns": str(OFFSET_NS)}
    assert summary.attachments["config.toml"].decode() == CONFIG


def test_derived_values_and_times_read_by_rosbags(run):
    for n in range(30):
        run.rings["control"].push(Kind.CONTROL_TICK, n * 10_000_000, tick_payload(n))
    run.finished()
    with AnyReader([run.out]) as bag:
        seen: dict[str, list] = {}
        for connection, time_ns, raw in bag.messages():
            seen.setdefault(connection.topic, []).append((time_ns, bag.deserialize(raw, connection.msgtype)))
    time_ns, raw = seen["/ft/wrench_raw"][8]
    assert (raw.wrench.force.x, raw.header.frame_id, time_ns) == (4.0, "ft_sensor", OFFSET_NS + 79_000_000)
    assert (raw.header.stamp.sec, raw.header.stamp.nanosec) == divmod(time_ns, 10**9)
    time_ns, joints = seen["/arm/joint_states"][8]
    assert (time_ns, len(joints.position), joints.name[0]) == (OFFSET_NS + 78_000_000, 6, "shoulder_pan_joint")
    wanted, sent = seen["/base/cmd_vel_raw"][3][1], seen["/base/cmd_vel"][3][1]
    assert (wanted.twist.linear.x, sent.twist.linear.x) == (0.2, 0.1)
    time_ns, tf = seen["/tf"][8]
    assert (time_ns, tf.transforms[0].child_frame_id) == (OFFSET_NS + 77_000_000, "base_link")
    assert (tf.transforms[0].transform.translation.x, tf.transforms[0].transform.translation.y) == (0.008, 0.25)
    assert [event.kind for _, event in seen["/safety/event"]] == ["mode", "fault", "cleared"]
    assert seen["/safety/event"][1][1].text == "ticks of the loop were skipped"
    assert seen["/loop/timing"][0][1].late_ns == 90_000
    assert seen["/control/tick"][8][1].input.base.pose.yaw == 0.5


def test_kill_9_of_control_loses_no_tick_and_finishes_the_file(run, tmp_path):
    payloads = tmp_path / "payloads.json"
    payloads.write_text(json.dumps([tick_payload(n).hex() for n in range(1500)]))
    control = subprocess.Popen(
        [sys.executable, "-c", PRODUCER, str(run.rings["control"].fd), str(payloads)],
        pass_fds=[run.rings["control"].fd, run.alive["control"]],
        stdout=subprocess.PIPE,
        text=True,
    )
    run.gone("control")  # the producer alone holds it now
    try:
        for _ in range(200):
            assert control.stdout.readline()
    finally:
        control.kill()
        pushed = [int(line) for line in control.stdout.read().splitlines()]
        control.stdout.close()
        control.wait()
    done = run.finished()
    last = max(pushed, default=199)
    assert ticks_of(run.out) == list(range(done["ticks"]))
    assert done["ticks"] in (last + 1, last + 2)  # the kill may fall between push and print
    assert done["dropped"]["control"] == 0


def test_signals_do_not_stop_it(run):
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        run.process.send_signal(number)
    run.rings["control"].push(Kind.CONTROL_TICK, 0, tick_payload(0))
    assert run.finished()["ticks"] == 1


def test_the_others_may_finish_their_word_after_control(run):
    run.gone("control")
    with pytest.raises(subprocess.TimeoutExpired):
        run.process.wait(0.1)
    run.rings["gate"].push(Kind.ROSOUT, 7, LOG.encode(Log(ros_time(7), 20, "gate", "zero sent", "", "", 0)))
    assert run.finished()["records"] == {"control": 0, "gate": 1}


def test_a_frozen_producer_does_not_hold_the_log_open_for_ever(run):
    run.rings["control"].push(Kind.CONTROL_TICK, 0, tick_payload(0))
    run.gone("control")
    done = run.event()
    assert (done["event"], done["complete"], done["ticks"]) == ("finished", True, 1)
    assert run.process.wait(10) == 0


def test_a_dropped_record_is_counted_and_the_chain_goes_on(tmp_path):
    run = Run(tmp_path / "run.mcap", capacity=40_000)
    run.event()
    os.kill(run.process.pid, signal.SIGSTOP)
    pushed = sum(run.rings["control"].push(Kind.CONTROL_TICK, n, tick_payload(n)) for n in range(40))
    os.kill(run.process.pid, signal.SIGCONT)
    done = run.finished()
    assert 0 < pushed < 40
    assert done["dropped"]["control"] == 40 - pushed
    assert ticks_of(run.out) == list(range(pushed))
    assert read_summary(run.out).metadata["run_end"]["dropped_control"] == str(40 - pushed)
    run.close()


def test_a_full_disk_is_said_once_draining_goes_on_and_the_start_can_be_recovered(run, tmp_path):
    resource.prlimit(run.process.pid, resource.RLIMIT_FSIZE, (60_000, 60_000))
    n = 0

    def fill() -> bool:
        nonlocal n
        for _ in range(50):
            run.rings["control"].push(Kind.CONTROL_TICK, n * 10_000_000, tick_payload(n))
            n += 1
        return bool(select.select([run.status], [], [], 0)[0])

    wait_for(fill)
    error = run.event()
    assert error["event"] == "error"
    assert "cannot be written" in error["error"]["what"]
    assert error["error"]["where"] == str(run.out)
    for _ in range(3):
        fill()
    wait_for(lambda: run.rings["control"].pop_all(0) == [] and ring_empty(run.rings["control"]))
    for name in tuple(run.alive):
        run.gone(name)
    done = run.event()
    assert (done["event"], done["complete"]) == ("finished", False)
    assert done["lost"] > 0
    assert done["records"]["control"] + done["dropped"]["control"] == n
    assert run.process.wait(10) == 1
    with pytest.raises(LogDamaged, match="truncated"):
        read_summary(run.out)
    assert recover(run.out, tmp_path / "out.mcap").messages > 0
    numbers = ticks_of(tmp_path / "out.mcap")
    assert numbers == list(range(len(numbers)))


def ring_empty(ring: Ring) -> bool:
    head = int.from_bytes(os.pread(ring.fd, 8, 0), "little")
    return head == int.from_bytes(os.pread(ring.fd, 8, 64), "little")


def test_kill_9_of_the_recorder_leaves_a_log_that_recovers(run, tmp_path):
    for n in range(200):
        run.rings["control"].push(Kind.CONTROL_TICK, n * 10_000_000, tick_payload(n))
    wait_for(lambda: flushed_ticks(run.out) == 200)  # at the latest a quarter of a second after the last
    run.process.kill()
    run.process.wait()
    assert recover(run.out, tmp_path / "out.mcap").messages > 0
    numbers = ticks_of(tmp_path / "out.mcap")
    assert numbers == list(range(200))


def flushed_ticks(path: Path) -> int:
    count, ticks = 0, -1
    try:
        for item in walk(path, finished=False):
            if isinstance(item, Topic) and item.channel.topic == "/control/tick":
                ticks = item.channel.id
            count += isinstance(item, McapMessage) and item.channel_id == ticks
    except LogDamaged:
        return count
    return count


def test_rubbish_in_a_ring_is_an_event_and_not_the_end(run):
    gate = run.rings["gate"]
    gate.push(Kind.ROSOUT, 1, bytes(8))
    wait_for(lambda: ring_empty(gate))
    os.pwrite(gate.fd, (2**40).to_bytes(8, "little"), 0)
    error = run.event()
    assert (error["event"], error["error"]["where"]) == ("error", "the ring of gate")
    run.rings["control"].push(Kind.CONTROL_TICK, 0, b"\x00\x01\x00\x00 this is no tick")
    run.rings["control"].push(99, 0, b"")
    run.rings["control"].push(Kind.CONTROL_TICK, 10_000_000, tick_payload(1))
    done = run.finished()
    assert (done["ticks"], done["undecodable"]) == (2, 1)
    assert read_summary(run.out).metadata["run_end"]["unknown_kinds"] == "1"


def test_an_existing_log_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "run.mcap").write_bytes(b"precious")
    run = Run(tmp_path / "run.mcap")
    error = run.event()
    assert (error["event"], error["error"]["where"]) == ("error", str(run.out))
    assert run.process.wait(10) == 2
    assert run.out.read_bytes() == b"precious"
    run.close()


def test_every_kind_has_its_own_topic():
    assert set(CHANNELS) == set(Kind)
    assert len({channel.topic for channel in CHANNELS.values()}) == len(Kind)
