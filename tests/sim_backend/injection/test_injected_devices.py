"""Each kind of fault, at the edge of a device made of literal samples: what arrives, when, and what is counted."""

import math
import random

import pytest
from msgspec.structs import replace

from robot_io.messages import (
    ArmRecord,
    ArmState,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    DeviceHealth,
    JointState,
    LinkState,
    Pose2D,
    SensorWrench,
    SliderPose,
    Stamped,
)
from sim_backend.injection.arm import InjectedArm
from sim_backend.injection.base import InjectedBase
from sim_backend.injection.injection import Injection
from sim_backend.injection.sensor import InjectedSensor
from tools.rig import resolve_rig

MS = 1_000_000
BEGIN_NS = 5_000 * MS
RIG = resolve_rig("sim")


class Device:
    """Gives what a test puts into it, and keeps what it was told."""

    sent_ns = newest_inbound_ns = 0
    newest_pong_ns = 7

    def __init__(self):
        self.samples = ()
        self.record = None
        self.told = []

    def drain(self):
        samples, self.samples = self.samples, ()
        return samples

    def read(self):
        return self.record

    def command(self, wanted):
        self.told.append(wanted)
        self.sent_ns += 1
        return wanted

    def health(self):
        return DeviceHealth(LinkState.UP, "", {"packets_ok": 100, "crc_fail": 3}, 100.0)


class Bench:
    """A device under faults; times in ms after the first tick."""

    def __init__(self, *words):
        self.now_ns = BEGIN_NS
        self.firsts = []
        self.inside = Device()
        note = lambda word, ns: self.firsts.append((word.text, (ns - BEGIN_NS) / MS))  # noqa: E731
        self.injection = Injection(words, lambda: self.now_ns, note)
        self.injection.begin(BEGIN_NS)
        self.sensor = InjectedSensor(self.inside, self.injection, RIG)
        self.arm = InjectedArm(self.inside, self.injection)
        self.base = InjectedBase(self.inside, self.injection)

    def felt(self, t_ms, *force):
        """Return the numbers that arrive when the sensor sends one sample at `t_ms`."""
        self.now_ns = BEGIN_NS + t_ms * MS
        self.inside.samples = (Stamped(SensorWrench(*force, *(0.0,) * (6 - len(force))), t_ms, self.now_ns),)
        return [(s.value.fx, s.value.fy, s.value.fz, s.value.mx) for s in self.sensor.drain()]

    def heard(self, t_ms, *values):
        """Return the values that arrive when the base sends these at `t_ms`."""
        self.now_ns = BEGIN_NS + t_ms * MS
        self.inside.samples = tuple(Stamped(value, t_ms, self.now_ns, 42.0) for value in values)
        return [sample.value for sample in self.base.drain()]

    def seen(self, t_ms, *position):
        """Return the record of the arm at `t_ms`."""
        self.now_ns = BEGIN_NS + t_ms * MS
        joints = JointState((*position, *(0.0,) * (6 - len(position))), (0.0,) * 6, int(ArmState.HOLDING), 0, 1.0)
        self.inside.record = ArmRecord(joints, t_ms, self.now_ns, self.now_ns, int(LinkState.UP))
        return self.arm.read()

    def obeyed(self, t_ms, *twist):
        """Return what the base is told when `twist` is sent at `t_ms`."""
        self.now_ns = BEGIN_NS + t_ms * MS
        self.inside.told.clear()
        self.base.command(BodyTwist(*twist))
        return list(self.inside.told)


def test_nothing_is_changed_before_the_first_tick_and_outside_the_time():
    bench = Bench("ft.off at 0 s for 0.05 s")
    bench.injection = Injection(["ft.off at 0 s"], lambda: bench.now_ns, lambda *_: None)
    before = InjectedSensor(bench.inside, bench.injection, RIG)
    bench.inside.samples = (Stamped(SensorWrench(1, 0, 0, 0, 0, 0), 0, BEGIN_NS),)
    assert len(before.drain()) == 1
    bench = Bench("ft.off at 0.02 s for 0.02 s")
    assert [len(bench.felt(t, 1.0)) for t in (0, 10, 20, 30, 40)] == [1, 1, 0, 0, 1]
    assert bench.injection.counts() == {"ft.off at 0.02 s for 0.02 s": 2}
    assert bench.firsts == [("ft.off at 0.02 s for 0.02 s", 20.0)]


@pytest.mark.parametrize(
    ("word", "arrives"),
    [
        ("ft.frozen", (1.0, 2.0, 3.0, 0.0)),
        ("ft.wrong=5,0,-1", (16.0, 2.0, 32.0, 0.0)),
        ("ft.scaled=3", (33.0, 6.0, 99.0, 0.0)),
        ("ft.mirrored", (-11.0, -2.0, -33.0, 0.0)),
        ("ft.drifting=0,1,0", (11.0, 2.01, 33.0, 0.0)),
        ("ft.dead-axis=2", (11.0, 2.0, 3.0, 0.0)),
        ("ft.saturated=0", (300.0, 2.0, 33.0, 0.0)),
    ],
)
def test_forces_are_changed(word, arrives):
    bench = Bench(f"{word} at 0 s")
    bench.felt(0, 1.0, 2.0, 3.0)
    [found] = bench.felt(10, 11.0, 2.0, 33.0)
    assert found == pytest.approx(arrives)


def test_a_force_turned_about_the_vertical_keeps_its_vertical_part():
    """The rig's third row of base_from_sensor is the vertical in the SENSOR frame."""
    up = RIG.frames.base_from_sensor[2]
    bench = Bench("ft.turned=180 at 0 s")
    [(fx, fy, fz, _)] = bench.felt(0, *(7.0 * u for u in up))
    assert (fx, fy, fz) == pytest.approx([7.0 * u for u in up])
    forward = RIG.frames.base_from_sensor[0]
    [(fx, fy, fz, _)] = bench.felt(10, *(7.0 * u for u in forward))
    assert (fx, fy, fz) == pytest.approx([-7.0 * u for u in forward])


def test_garbage_is_no_number_or_random_within_the_value():
    bench = Bench("ft.garbage at 0 s")
    assert all(map(math.isnan, bench.felt(0, 1.0, 2.0, 3.0)[0]))
    bench = Bench("ft.garbage=8 at 0 s")
    found = [bench.felt(t, 1.0)[0] for t in range(0, 500, 10)]
    assert len(set(found)) == 50
    assert 6.0 < max(max(map(abs, one)) for one in found) <= 8.0


def test_a_spike_is_one_sample_in_fifty():
    bench = Bench("ft.spike=90 at 0 s")
    off = [bench.felt(10 * k, 0.0)[0][2] for k in range(101)]
    assert [k for k, value in enumerate(off) if value] == [0, 50, 100]
    assert off[50] == 90.0


def test_a_damaged_packet_is_dropped_and_counted_as_the_driver_does():
    bench = Bench("ft.crc=4 at 0 s")
    assert [len(bench.felt(10 * k, 1.0)) for k in range(8)] == [1, 1, 1, 0, 1, 1, 1, 0]
    assert bench.sensor.health().counters == {"packets_ok": 98, "crc_fail": 5}


def test_a_packet_torn_by_a_stray_byte_is_junk_and_no_candidate_of_it_passes():
    bench = Bench("ft.junk=4 at 0 s")
    assert [len(bench.felt(10 * k, 1.0)) for k in range(8)] == [1, 1, 1, 0, 1, 1, 1, 0]
    counters = {"packets_ok": 98, "crc_fail": 5, "junk_bytes": 34, "resyncs": 2}  # twice 16 bytes and one more
    assert bench.sensor.health().counters == counters


def test_a_lost_link_stays_lost():
    bench = Bench("ft.lost at 0.01 s for 0.01 s")
    assert len(bench.felt(0, 1.0)) == 1
    assert bench.sensor.health().state == LinkState.UP
    assert bench.felt(10, 1.0) == bench.felt(30, 1.0) == []
    assert bench.sensor.health().state == LinkState.LOST


def test_slow_delayed_and_intermittent_samples():
    bench = Bench("ft.slow=20 at 0 s")
    assert sum(len(bench.felt(10 * k, 1.0)) for k in range(100)) == 20
    bench = Bench("ft.slow=50 at 0 s")
    jitter = random.Random(0)
    passed = sum(len(bench.felt(10 * k + jitter.choice((0, 1, 2)), 1.0)) for k in range(100))
    assert 49 <= passed <= 51, "whatever the jitter of the samples"
    bench = Bench("ft.intermittent=0.2 at 0 s")
    assert [len(bench.felt(t, 1.0)) for t in (0, 90, 100, 190, 200, 290, 300)] == [0, 0, 1, 1, 0, 0, 1]
    bench = Bench("ft.delayed=0.05 at 0 s for 0.1 s")
    found = {t: [value[0] for value in bench.felt(t, float(t))] for t in range(0, 130, 10)}
    assert found[40] == []
    assert found[50] == [0.0]
    assert found[90] == [40.0]
    assert found[100] == [50.0, 60.0, 70.0, 80.0, 90.0, 100.0], "what was held back comes before what follows"
    bench = Bench("base.odometry.delayed=0.05 at 0 s")
    bench.heard(0, BaseOdometry(BodyTwist(0.1)))
    bench.now_ns = BEGIN_NS + 60 * MS
    [sample] = bench.base.drain()
    assert (sample.received_ns - BEGIN_NS) / MS == 50.0
    assert sample.device_time_s == 42.0, "the device's own stamp stays: it ages"


def test_the_arm_under_faults():
    assert Bench("arm.wrong=0,0.01 at 0 s").seen(0, 1.0, 2.0).joints.position == (1.0, 2.01, 0, 0, 0, 0)
    assert Bench("arm.protective-stop at 0 s").seen(0).joints.state == ArmState.PROTECTIVE_STOP
    assert Bench("arm.emergency-stop at 0 s").seen(0).joints.state == ArmState.EMERGENCY_STOP
    assert Bench("arm.powered-off at 0 s").seen(0).joints.state == ArmState.OFF
    assert Bench("arm.freedrive at 0 s").seen(0).joints.state == ArmState.MOVING
    assert Bench("arm.other-program at 0 s").seen(0).joints.state == ArmState.FOREIGN_PROGRAM
    assert Bench("arm.lost at 0 s").seen(0).link == LinkState.LOST
    assert math.isnan(Bench("arm.garbage at 0 s").seen(0).joints.position[5])
    bench = Bench("arm.moving=0.2 at 0 s")
    bench.seen(0, 1.0)
    record = bench.seen(500, 1.0)
    assert record.joints.position[0] == pytest.approx(1.1)
    assert record.joints.velocity[0] == pytest.approx(0.2)
    bench = Bench("arm.drifting=0.2 at 0 s")
    bench.seen(0, 1.0)
    assert bench.seen(500, 1.0).joints.velocity[0] == 0.0


def test_a_silent_and_a_frozen_arm():
    bench = Bench("arm.off at 0.01 s")
    before = bench.seen(0, 1.0)
    assert bench.seen(10, 2.0) == bench.seen(50, 2.0) == before
    bench = Bench("arm.frozen at 0 s")
    first, later = bench.seen(0, 1.0), bench.seen(50, 2.0)
    assert later == replace(first, published_ns=first.published_ns + 50 * MS)


POSE, LATER = BasePose(Pose2D(1.0, 2.0, 0.1)), BasePose(Pose2D(3.0, 2.0, 0.2))


@pytest.mark.parametrize(
    ("word", "arrives"),
    [
        ("frozen", (1.0, 2.0, 0.1)),
        ("wrong=0.5,0,1", (3.5, 2.0, 1.2)),
        ("scaled=0.5", (2.0, 2.0, 0.2)),
        ("mirrored", (-1.0, 2.0, 0.2)),
        ("turned=90", (1.0, 4.0, 0.2)),
        ("drifting=0,0.5", (3.0, 2.5, 0.2)),
    ],
)
def test_poses_are_changed_from_where_the_base_was(word, arrives):
    bench = Bench(f"base.pose.{word} at 0 s")
    bench.heard(0, POSE)
    [found] = bench.heard(1000, LATER)
    assert (found.pose.x, found.pose.y, found.pose.yaw) == pytest.approx(arrives)


def test_other_faults_of_the_pose():
    assert not Bench("base.pose.invalid at 0 s").heard(0, POSE)[0].valid
    slider = SliderPose(Pose2D(9.0, 8.0, 0.5))
    assert Bench("base.pose.swapped at 0 s").heard(0, slider, POSE)[1].pose == slider.pose
    bench = Bench("base.pose.trembling=0.01 at 0 s")
    bench.heard(0, POSE)
    [found] = bench.heard(1000, LATER)
    assert 0.0 < math.hypot(found.pose.x - 1.0, found.pose.y - 2.0) < 0.0142
    odometry = BaseOdometry(BodyTwist(0.1))
    assert Bench("base.pose.off at 0 s").heard(0, POSE, odometry) == [odometry], "only the pose is silent"


def test_odometry_and_status_are_changed():
    twist = BaseOdometry(BodyTwist(0.1, 0.02, 0.3))
    found = Bench("base.odometry.mirrored at 0 s").heard(0, twist)[0].twist
    assert found == BodyTwist(-0.1, -0.02, -0.3)
    found = Bench("base.odometry.turned=90 at 0 s").heard(0, twist)[0].twist
    assert (found.vx, found.vy, found.omega) == pytest.approx((-0.02, 0.1, 0.3))
    report = BaseReport(BaseStatus(False, True, 26.0))
    assert Bench("base.status.e-stop at 0 s").heard(0, report)[0].status == BaseStatus(True, False, 26.0)
    assert Bench("base.status.motors-off at 0 s").heard(0, report)[0].status == BaseStatus(False, False, 26.0)
    assert Bench("base.status.scaled=0.5 at 0 s").heard(0, report)[0].status.battery_v == 13.0


def test_commands_are_changed_and_the_sender_does_not_know():
    assert Bench("base.command.off at 0 s").obeyed(0, 0.1) == []
    assert Bench("base.command.ignored at 0 s").obeyed(0, 0.1) == [BodyTwist()]
    assert Bench("base.command.scaled=3 at 0 s").obeyed(0, 0.1) == [BodyTwist(pytest.approx(0.3))]
    assert Bench("base.command.mirrored at 0 s").obeyed(0, 0.1) == [BodyTwist(-0.1, -0.0, -0.0)]
    bench = Bench("base.command.frozen at 0 s")
    bench.obeyed(0, 0.1)
    assert bench.obeyed(10) == [BodyTwist(0.1)]
    assert bench.base.command(BodyTwist(0.05)) == BodyTwist(0.05)
    assert bench.base.sent_ns == bench.now_ns
    bench = Bench("base.command.delayed=0.03 at 0 s")
    assert bench.obeyed(0, 0.1) == bench.obeyed(20, 0.2) == []
    assert bench.obeyed(30, 0.3) == [BodyTwist(0.1)]
    for t in range(0, 300, 10):
        [wild] = Bench("base.command.garbage=0.4 at 0 s").obeyed(t, 0.1)
        assert math.isfinite(wild.vx)
        assert abs(wild.vx) <= 0.4


def test_a_base_whose_link_is_lost():
    bench = Bench("base.command.lost at 0.01 s")
    assert bench.obeyed(0, 0.1) == [BodyTwist(0.1)]
    sent_ns = bench.base.sent_ns
    assert bench.obeyed(10, 0.1) == []
    assert bench.base.sent_ns == sent_ns
    assert bench.heard(20, POSE) == []
    assert bench.base.health().state == LinkState.LOST


def test_the_first_command_is_the_first_tick_where_none_was_named():
    bench = Bench()
    bench.injection = Injection(["base.command.off at 0.02 s"], lambda: bench.now_ns, lambda *_: None)
    bench.base = InjectedBase(bench.inside, bench.injection)
    assert len(bench.obeyed(100, 0.1)) == len(bench.obeyed(110, 0.1)) == 1
    assert bench.obeyed(120, 0.1) == []


def test_a_fault_that_changes_nothing_counts_nothing():
    bench = Bench("base.pose.frozen at 0 s")
    bench.heard(0, POSE)
    bench.heard(10, POSE)
    assert bench.injection.counts() == {"base.pose.frozen at 0 s": 0}
    assert bench.firsts == []
