"""Links that freeze, die, swallow and poison: what reaches the base afterwards, and what the driver says."""

import itertools
import json
import os
import signal
import time

import pytest
import websocket

from robot_io.messages import BaseFeed, BasePose, BodyTwist, CommandEcho, LinkState, Pose2D, SliderPose, Stamped
from robot_io.ridgeback.driver import FRESH_NS, LINK_STALE_NS, Ridgeback
from robot_io.ridgeback.websocket_link import LinkLost, WebSocketLink
from robot_io.rig.topics import TopicsConfig
from sim_backend.ridgeback.settings import DEFAULT_SLIDER_TOPIC
from tests.wire.bridge_process import Bridge, running_bridge, until

FORWARD = BodyTwist(0.1, 0.0, 0.0)
TOPICS = TopicsConfig(status="")  # the status comes once a second, and start waits for it
MS = 1_000_000


def drive(base: Ridgeback, seconds: float) -> list[tuple[int, BodyTwist]]:
    """Command every 10 ms for a while; return when what was really sent."""
    sent = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        base.drain()
        twist = base.command(FORWARD)
        sent.append((time.monotonic_ns(), twist))
        time.sleep(0.01)
    return sent


def drive_until_lost(base: Ridgeback) -> list[tuple[int, BodyTwist]]:
    sent: list[tuple[int, BodyTwist]] = []

    def lost() -> bool:
        sent.extend(drive(base, 0.02))
        return base.health().state == LinkState.LOST

    assert until(lost, every_s=0)
    return sent


def moving(heard: list[tuple[int, float, float, float]], since_ns: int) -> list[tuple[int, float, float, float]]:
    return [entry for entry in heard if entry[0] >= since_ns and entry[1:] != (0.0, 0.0, 0.0)]


@pytest.fixture
def bridge():
    with running_bridge() as running:
        yield running


def test_a_bridge_that_falls_silent_is_given_up_although_nothing_is_commanded(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        bridge.do("freeze", 2.0)
        assert until(lambda: base.drain() == () and base.health().state == LinkState.LOST, seconds=1.5)
        assert base.health().cause == "no message from the bridge for 0.3 s"


@pytest.mark.long
def test_a_frozen_bridge_gives_the_base_nothing_old_to_move_by(bridge: Bridge):
    """It has commands in hand when it freezes, and delivers them when it goes on: zeros follow at once."""
    base = Ridgeback(bridge.url, topics=TOPICS)
    closing: list[int] = []
    base.before_close = closing.append
    with base:
        drive(base, 0.3)
        froze_ns = bridge.do("freeze", 1.0)
        sent = drive_until_lost(base)
        lost_ns = sent[-1][0]
        assert 0 < lost_ns - froze_ns < LINK_STALE_NS + 500 * MS
        assert "0.3 s" in base.health().cause
        last_moving = max(t for t, twist in sent if twist != BodyTwist())
        assert last_moving - froze_ns < FRESH_NS + 150 * MS
        assert base.health().counters["held_back"] > 0
        assert base.command(FORWARD) == BodyTwist()  # never by itself
        assert base.drain() == ()
        assert closing == []  # zeros still have to follow
        drive(base, 0.95 - (time.monotonic_ns() - froze_ns) / 1e9)
        before = bridge.report()
        assert before["velocity"] == [0.0, 0.0, 0.0]  # the base's own timeout
        drive(base, 0.7)
        after = bridge.report()
    assert after["pose"][0] - before["pose"][0] < 0.001
    heard = [tuple(entry) for entry in after["heard"]]
    late = moving(heard, before["now_ns"])
    assert len(late) > 1  # the hazard was there ...
    zero_ns = next(t for t, *twist in heard if t >= late[-1][0] and not any(twist))
    assert heard[-1][1:] == (0.0, 0.0, 0.0)
    assert zero_ns - late[0][0] < 40 * MS  # ... for less than a tick of the base
    assert len(closing) == 1
    assert until(lambda: bridge.report()["clients"] == 0)


@pytest.mark.long
def test_the_same_freeze_bursts_for_a_client_without_these_precautions(bridge: Bridge):
    # The hazard is real in the emulator, or the test above would prove nothing.
    naive = websocket.create_connection(bridge.url, timeout=1)
    naive.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/Twist"}))
    froze_ns = bridge.do("freeze", 0.6)
    command = json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.1}}})
    for _ in range(40):
        naive.send(command)
        time.sleep(0.01)
    assert until(lambda: len(moving(bridge.heard(), froze_ns + 590 * MS)) == 40)
    times = [entry[0] for entry in moving(bridge.heard(), froze_ns)]
    assert times[-1] - times[0] < 100 * MS
    naive.close()


def test_a_stopped_process_moves_the_base_no_more_either(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.3)
        os.kill(bridge.process.pid, signal.SIGSTOP)
        stopped_ns = time.monotonic_ns()
        drive_until_lost(base)
        os.kill(bridge.process.pid, signal.SIGCONT)
        resumed_ns = time.monotonic_ns()
        drive(base, 0.2)
        heard = bridge.heard()
    assert resumed_ns - stopped_ns > LINK_STALE_NS
    assert heard[-1][1:] == (0.0, 0.0, 0.0)
    assert moving(heard, resumed_ns + 150 * MS) == []


def test_killed_bridge_is_lost_at_once(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.2)
        killed_ns = bridge.do("kill")
        sent = drive_until_lost(base)
        assert sent[-1][0] - killed_ns < LINK_STALE_NS  # by the reset, not by silence
        assert base.health().cause
        assert base.fileno() == -1
        base.stop()
    assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])  # the base's own timeout


def test_a_restarted_bridge_is_not_rejoined_by_itself(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.2)
        bridge.do("restart", 0.1)
        drive_until_lost(base)
        restarted_ns = bridge.report()["now_ns"] + 150 * MS
        drive(base, 0.5)
        assert base.health().state == LinkState.LOST
        assert moving(bridge.heard(), restarted_ns) == []
        with base:  # asked for, it comes back
            assert base.command(FORWARD) == FORWARD


def test_half_open_link_is_given_up(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.2)
        pong_ns = base.newest_pong_ns
        began_ns = bridge.do("half_open")
        sent = drive_until_lost(base)
        assert LINK_STALE_NS - 50 * MS < sent[-1][0] - began_ns < LINK_STALE_NS + 500 * MS
        assert base.newest_pong_ns - pong_ns < 300 * MS
    assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])
    assert moving(bridge.heard(), began_ns + 10 * MS) == []


def test_a_bridge_that_does_not_read_is_given_up_without_blocking(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        bridge.do("stop_reading", 30.0)
        slowest = 0.0
        for _ in range(200_000):
            before = time.perf_counter()
            base.command(FORWARD)
            slowest = max(slowest, time.perf_counter() - before)
            base.drain()  # feeds still come: only the outward way is stuck
            if base.health().state == LinkState.LOST:
                break
        assert base.health().state == LinkState.LOST
        assert "is not reading" in base.health().cause
        assert slowest < 0.5  # it never waited for the 30 s


def test_a_bridge_that_reads_nothing_for_a_while_moves_the_base_no_more(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.5)
        stopped_ns = bridge.do("stop_reading", 2.5)
        sent = drive_until_lost(base)  # feeds still come, our own commands do not come back
        assert LINK_STALE_NS - 50 * MS < sent[-1][0] - stopped_ns < LINK_STALE_NS + 500 * MS
        assert "none of our commands" in base.health().cause
        drive(base, 1.0)
        assert base.health().state == LinkState.LOST
        resting = bridge.report()
        assert resting["velocity"] == [0.0, 0.0, 0.0]
        base.stop()
    assert until(lambda: bridge.report()["clients"] == 0, seconds=8.0)  # it reads again, after the driver has gone
    heard = bridge.heard()
    assert len(moving(heard, stopped_ns + 50 * MS)) > 1
    assert heard[-1][1:] == (0.0, 0.0, 0.0)
    assert bridge.report()["pose"][0] - resting["pose"][0] < 0.001


def test_part_of_a_message_is_a_lost_link(bridge: Bridge):
    link = WebSocketLink.connect(bridge.url)
    with pytest.raises(LinkLost, match="part"):
        link.send_text(b" " * 50_000_000)
    link.abort()


def test_a_poisoned_connection_is_seen_by_the_missing_echo(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        assert until(lambda: bool(drive(base, 0.02)) and base.health().counters["echo"] > 5, every_s=0)
        link = base._link
        assert link is not None
        link.send_text(b'{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":0.1,"y":0,"z":0}')
        assert until(lambda: bool(drive(base, 0.02)) and bridge.report()["counters"].get("poisoned", 0) > 5, every_s=0)
        drive_until_lost(base)  # it looks healthy, but of our own commands nothing is heard
        assert "none of our commands" in base.health().cause
    assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])


def test_nothing_that_moves_is_sent_when_nobody_drained_for_long(bridge: Bridge):
    # Without draining the newest message looks old; the driver looks into its socket before it refuses.
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        time.sleep(0.15)
        assert base.command(FORWARD) == FORWARD
        assert base.health().counters["held_back"] == 0


@pytest.mark.parametrize(
    ("fault", "kind"), [pytest.param("occlude_base", BasePose, marks=pytest.mark.long), ("occlude_slider", SliderPose)]
)
def test_occlusion_leaves_the_pose_out_and_keeps_the_link(bridge: Bridge, fault, kind):
    with Ridgeback(bridge.url, topics=TopicsConfig(status="", slider_pose=DEFAULT_SLIDER_TOPIC)) as base:
        samples = []

        def seen() -> int:
            samples.extend(sample for sample in base.drain() if isinstance(sample.value, kind))
            return len(samples)

        assert until(lambda: seen() > 5)
        bridge.do(fault, 0.4)
        end = time.monotonic() + 0.8
        while time.monotonic() < end:
            seen()
            time.sleep(0.005)
        gaps = [b.received_ns - a.received_ns for a, b in itertools.pairwise(samples)]
        assert max(gaps) > 300 * MS
        assert base.health().state == LinkState.UP


def test_a_pose_jump_comes_through_for_safety_to_judge(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        bridge.do("jump_pose", Pose2D(0.5, 0.0, 0.0), 0.1)
        seen: list[float] = []

        def jumped() -> bool:
            seen.extend(s.value.pose.x for s in base.drain() if isinstance(s.value, BasePose))
            return any(x > 0.4 for x in seen) and seen[-1] < 0.4

        assert until(jumped)


def pose_age(base: Ridgeback) -> float:
    """Median age (s) of a few fresh poses by their own stamps."""
    base.drain()
    ages: list[float] = []

    def enough() -> bool:
        ages.extend(time.time() - s.device_time_s for s in base.drain() if isinstance(s.value, BasePose))
        return len(ages) > 10

    assert until(enough)
    return sorted(ages)[len(ages) // 2]


def test_lag_shows_in_the_stamps(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        normal = pose_age(base)
        bridge.do("lag", 0.09)
        assert until(lambda: pose_age(base) > normal + 0.06)
        assert base.health().state == LinkState.UP


@pytest.mark.long
def test_poses_that_jitter_come_late_by_different_times_and_in_order():
    with running_bridge({"mocap_jitter_s": 0.008}) as bridge, Ridgeback(bridge.url, topics=TOPICS) as base:
        poses: list[Stamped[BaseFeed]] = []

        def seen() -> int:
            poses.extend(sample for sample in base.drain() if isinstance(sample.value, BasePose))
            return len(poses)

        assert until(lambda: seen() >= 100, every_s=0.0005)
    late_s = sorted(pose.received_ns * 1e-9 - pose.device_time_s for pose in poses)
    assert late_s[90] - late_s[10] > 0.003
    stamps = [pose.device_time_s for pose in poses]
    assert stamps == sorted(stamps)


def test_the_clocks_of_robot_and_laptop_need_not_agree():
    with running_bridge({}, {"clock_skew_s": 30.0}) as bridge, Ridgeback(bridge.url, topics=TOPICS) as base:
        seen = [sample for sample in base.drain() if isinstance(sample.value, BasePose)]
        assert abs(seen[-1].device_time_s - time.time() - 30.0) < 5.0
        drive(base, 0.3)
        assert moving(bridge.heard(), 0)
        assert base.health().state == LinkState.UP


def test_motion_capture_is_as_late_as_it_says():
    with running_bridge({"mocap_latency_s": 0.05}) as bridge, Ridgeback(bridge.url, topics=TOPICS) as base:
        assert pose_age(base) > 0.049


def test_the_joystick_wins(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.1)
        bridge.do("joystick", BodyTwist(0.0, -0.2, 0.0), 0.3)
        assert until(lambda: bool(drive(base, 0.05)) and bridge.report()["velocity"][1] == -0.2, every_s=0)
        heard = bridge.heard()
        joystick = [entry for entry in heard if entry[2] == -0.2]
        between = [e for e in heard if joystick[0][0] < e[0] < joystick[-1][0]]
        assert all(entry[2] == -0.2 for entry in between)  # ours are dropped, not mixed in
        assert bridge.report()["counters"]["commands_masked"] > 0
        assert until(lambda: bool(drive(base, 0.05)) and bridge.heard()[-1][1] == 0.1, every_s=0)  # and back


def test_zero_on_a_new_connection():
    settings = {"zero_on_new_connection": True}
    with running_bridge(bridge=settings) as bridge, Ridgeback(bridge.url, topics=TOPICS) as base:
        drive(base, 0.1)
        first = next(i for i, entry in enumerate(bridge.heard()) if entry[1] == 0.1)
        other = websocket.create_connection(bridge.url, timeout=1)
        other.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/Twist"}))

        def braked() -> bool:
            drive(base, 0.02)
            return (0.0, 0.0, 0.0) in [entry[1:] for entry in bridge.heard()[first:]]

        assert until(braked, every_s=0)
        other.close()


def test_echo_comes_from_whoever_commands(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        other = websocket.create_connection(bridge.url, timeout=1)
        other.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"y": 0.07}}}))
        echoes: list[BodyTwist] = []
        assert until(
            lambda: bool(
                echoes.extend(s.value.twist for s in base.drain() if isinstance(s.value, CommandEcho))
                or BodyTwist(0.0, 0.07, 0.0) in echoes
            )
        )
        other.close()
