"""The real driver against the emulated bridge in another process: flow, refusals, checks before motion."""

import itertools
import math
import socket
import time

import msgspec
import pytest

from robot_io.errors import ConfigError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseReport,
    BodyTwist,
    CommandEcho,
    LinkState,
    SliderPose,
    Stamped,
)
from robot_io.ridgeback.driver import Ridgeback
from robot_io.rig.topics import TopicsConfig
from tests.wire.bridge_process import Bridge, running_bridge, until

FORWARD = BodyTwist(0.1, 0.0, 0.0)
TOPICS = TopicsConfig(slider_pose="/vicon/ThingBox/ThingBox")
QUICK = TopicsConfig(status="")
"""The status comes once a second, and start waits for it."""


def gather(base: Ridgeback, seconds: float, twist: BodyTwist | None = None) -> list[Stamped[BaseFeed]]:
    """Drain for a while, with a command every 10 ms if asked."""
    samples: list[Stamped[BaseFeed]] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if twist is not None:
            base.command(twist)
        samples += base.drain()
        time.sleep(0.01)
    return samples


def gather_until(base: Ridgeback, wanted: type, twist: BodyTwist | None = None) -> Stamped[BaseFeed]:
    found: list[Stamped[BaseFeed]] = []

    def look() -> bool:
        if twist is not None:
            base.command(twist)
        found.extend(sample for sample in base.drain() if isinstance(sample.value, wanted))
        return bool(found)

    assert until(look, every_s=0.01), f"no {wanted.__name__}"
    return found[-1]


RELATIVE = TopicsConfig(
    command="cmd_vel",
    odometry="odometry/filtered",
    base_pose="vicon/ThingBase_4/ThingBase_4",
    status="",
)


@pytest.fixture(scope="module")
def bridge():
    with running_bridge(topics=TOPICS) as running:
        yield running


def test_names_without_the_first_slash_are_the_same_topics(bridge: Bridge):
    """A real rosapi finds no listener of `cmd_vel`: it compares names as they are written."""
    with Ridgeback(bridge.url, topics=RELATIVE) as base:
        assert base.health().counters["unanswered_checks"] == 0
        gather_until(base, CommandEcho, BodyTwist())


def test_an_emulated_base_may_be_described_by_such_names_too():
    with running_bridge(topics=RELATIVE) as bridge, Ridgeback(bridge.url, topics=QUICK) as base:
        gather_until(base, BasePose)
        gather_until(base, BaseOdometry)
        gather_until(base, CommandEcho, BodyTwist())


def test_commands_move_the_base_and_every_feed_arrives(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        assert base.health().state == LinkState.UP
        start = gather_until(base, BasePose)
        samples = gather(base, 1.1, FORWARD)
        kinds = {type(sample.value) for sample in samples}
        assert kinds == {BasePose, BaseOdometry, BaseReport, SliderPose, CommandEcho}
        assert base.newest_pong_ns > 0
        health = base.health()
        assert health.counters["undecodable"] == health.counters["pose_flawed"] == 0
        assert health.counters["unasked"] == 0
        end = gather_until(base, BasePose)
        assert isinstance(end.value, BasePose)
        assert isinstance(start.value, BasePose)
        assert 0.05 < end.value.pose.x - start.value.pose.x < 0.2
        assert end.seq > start.seq
        echoes = [sample.value.twist for sample in samples if isinstance(sample.value, CommandEcho)]
        assert set(echoes) == {FORWARD}
        odometry = [sample.value.twist for sample in samples if isinstance(sample.value, BaseOdometry)]
        assert odometry[-1] == FORWARD
        poses = [sample for sample in samples if isinstance(sample.value, BasePose)]
        assert [b.seq - a.seq for a, b in itertools.pairwise(poses)] == [1] * (len(poses) - 1)
        assert all(b.received_ns >= a.received_ns for a, b in itertools.pairwise(poses))
        assert all(b.device_time_s > a.device_time_s for a, b in itertools.pairwise(poses))
    heard = bridge.heard()
    assert [entry[1:] for entry in heard[-3:]] == [(0.0, 0.0, 0.0)] * 3  # stop: zero, three times
    assert base.health().state == LinkState.CLOSED
    assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])


def test_command_reports_what_was_sent_and_refuses_nan(bridge: Bridge):
    with Ridgeback(bridge.url, topics=QUICK) as base:
        assert base.command(FORWARD) == FORWARD
        before = base.health().counters["sent"]
        with pytest.raises(ValueError, match="finite"):
            base.command(BodyTwist(math.nan, 0.0, 0.0))
        assert base.health().counters["sent"] == before
        assert base.health().state == LinkState.UP
    assert all(math.isfinite(entry[1]) for entry in bridge.heard())


def test_pose_from_odometry_starts_at_the_origin(bridge: Bridge):
    with Ridgeback(bridge.url, topics=QUICK, pose_source="odometry") as base:
        first = next(sample.value for sample in base.drain() if isinstance(sample.value, BasePose))
        assert (first.pose.x, first.pose.y, first.pose.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_pose_from_joint_states(bridge: Bridge):
    with Ridgeback(bridge.url, topics=QUICK, pose_source="joint_states") as base:
        sample = gather_until(base, BasePose).value
        assert isinstance(sample, BasePose)
        assert sample.valid
        assert sample.pose.x == pytest.approx(bridge.report()["pose"][0], abs=1e-6)


def test_markers_are_taken_off_the_pose():
    marker = (0.2, -0.1, 1.5)
    with (
        running_bridge({"base_from_marker": marker}) as bridge,
        Ridgeback(bridge.url, topics=QUICK, base_from_marker=marker) as base,
    ):
        gather(base, 0.3, BodyTwist(0.0, 0.0, 0.3))
        base.command(BodyTwist())
        assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])
        base.drain()
        truth = bridge.report()["pose"]
        assert truth[2] > 0.01

        def told() -> tuple[float, float, float]:
            pose = gather_until(base, BasePose).value.pose
            return (pose.x, pose.y, pose.yaw)

        # A pose that was measured just before the base stood may still be on its way.
        assert until(lambda: told() == pytest.approx(truth, abs=1e-9))


def test_inside_an_event_loop(bridge: Bridge):
    loop = EventLoop()
    samples: list[Stamped[BaseFeed]] = []
    with Ridgeback(bridge.url, topics=QUICK, before_close=loop.remove_fd) as base:
        loop.add_fd(base.fileno(), lambda _: samples.extend(base.drain()))
        timer = loop.call_every(10_000_000, lambda _: base.command(FORWARD))
        assert until(lambda: loop.run_once(50) or len(samples) > 100, every_s=0)
        timer.cancel()
    assert base.fileno() == -1
    loop.run_once(0)
    loop.close()


def test_ros_2_by_configuration():
    topics = TopicsConfig(
        ros_version=2,
        command="/r100_0001/cmd_vel",
        command_type="geometry_msgs/TwistStamped",
        base_pose_type="geometry_msgs/msg/TransformStamped",
    )
    with running_bridge(topics=topics) as bridge, Ridgeback(bridge.url, topics=topics) as base:
        samples = gather(base, 0.5, FORWARD)
        stamps = [sample.device_time_s for sample in samples if isinstance(sample.value, BasePose)]
        assert stamps[-1] == pytest.approx(time.time(), abs=1.0)
        echo = gather_until(base, CommandEcho, FORWARD).value
        assert echo == CommandEcho(FORWARD)
        assert (0.1, 0.0, 0.0) in [entry[1:] for entry in bridge.heard()]


def test_stop_button_and_battery_are_seen(bridge: Bridge):
    with Ridgeback(bridge.url) as base:
        gather_until(base, BaseReport)
        bridge.do("press_stop")
        pressed = gather_until(base, BaseReport, FORWARD).value
        assert isinstance(pressed, BaseReport)
        assert pressed.status.stop_engaged
        assert not pressed.status.drivers_active
        assert until(lambda: base.drain() is not None and bridge.report()["velocity"] == [0.0, 0.0, 0.0])
        bridge.do("battery", 21.5)
        bridge.do("release_stop")
        released = gather_until(base, BaseReport).value
        assert isinstance(released, BaseReport)
        assert msgspec.structs.astuple(released.status) == (False, True, 21.5)


def test_missing_server_is_named_in_time():
    with socket.socket() as placeholder:  # bound, not listening: the port is closed
        placeholder.bind(("127.0.0.1", 0))
        url = f"ws://127.0.0.1:{placeholder.getsockname()[1]}"
        began = time.monotonic()
        with pytest.raises(DeviceUnreachable, match="refused") as caught, Ridgeback(url):
            pass
        assert time.monotonic() - began < 1.5
    assert url in str(caught.value)
    assert caught.value.do


def test_a_server_that_accepts_and_says_nothing():
    with socket.create_server(("127.0.0.1", 0)) as dumb:
        began = time.monotonic()
        with pytest.raises(DeviceUnreachable, match="handshake"), Ridgeback(f"ws://127.0.0.1:{dumb.getsockname()[1]}"):
            pass
        assert time.monotonic() - began < 2.5


def test_something_that_is_no_websocket_server(http_server: str):
    with pytest.raises(DeviceProtocolError, match="not a websocket server"), Ridgeback(http_server):
        pass


@pytest.fixture
def http_server():
    import http.server
    import threading

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Quiet) as server:
        thread = threading.Thread(target=server.handle_request)  # a foreign server used as a peer
        thread.start()
        yield f"ws://127.0.0.1:{server.server_port}"
        thread.join(5)


@pytest.mark.parametrize("url", ["http://127.0.0.1:9090", "127.0.0.1:9090", "ws://", "wss://", "ws://a..b:9090"])
def test_a_bad_address_is_a_config_error(url):
    with pytest.raises(ConfigError):
        Ridgeback(url)


def test_wrong_type_of_the_command_topic_names_both(bridge: Bridge):
    topics = TopicsConfig(command_type="geometry_msgs/TwistStamped")
    with pytest.raises(DeviceProtocolError) as caught, Ridgeback(bridge.url, topics=topics):
        pass
    assert "geometry_msgs/TwistStamped" in caught.value.what
    assert "geometry_msgs/Twist," in caught.value.what
    assert "/cmd_vel" in caught.value.what


def test_ros_2_names_on_a_ros_1_robot_are_found_out(bridge: Bridge):
    with (
        pytest.raises(DeviceProtocolError, match="geometry_msgs/msg/Twist"),
        Ridgeback(bridge.url, topics=TopicsConfig(ros_version=2)),
    ):
        pass


def test_a_type_that_cannot_be_used_is_refused_before_connecting():
    with pytest.raises(ConfigError, match="PoseStamped"):
        Ridgeback("ws://127.0.0.1:1", topics=TopicsConfig(base_pose_type="geometry_msgs/PoseStamped"))
    with pytest.raises(ConfigError, match="pose_source"):
        Ridgeback("ws://127.0.0.1:1", topics=TopicsConfig(odometry=""), pose_source="odometry")


def test_nobody_listens_to_the_commands():
    with running_bridge() as bridge:
        bridge.do("subscriber_missing")
        with pytest.raises(DeviceNotReady, match="nothing subscribes"), Ridgeback(bridge.url):
            pass


def test_another_client_of_the_bridge_is_no_listener():
    with running_bridge() as bridge, Ridgeback(bridge.url, topics=QUICK):  # this one subscribes to the command topic
        bridge.do("subscriber_missing")
        with pytest.raises(DeviceNotReady, match="nothing subscribes"), Ridgeback(bridge.url, topics=QUICK):
            pass


@pytest.mark.long
def test_a_silent_topic_is_named():
    """A topic that speaks once a second is waited for 4 s; connecting to a bridge that answers takes no second."""
    topics = TopicsConfig(base_pose="/vicon/Nobody/Nobody")
    with running_bridge() as bridge:
        began = time.monotonic()
        with (
            pytest.raises(DeviceNotReady, match="/vicon/Nobody/Nobody") as caught,
            Ridgeback(bridge.url, topics=topics),
        ):
            pass
        assert 4.0 <= time.monotonic() - began < 5.0
        assert "/odometry/filtered" not in caught.value.what


def test_without_rosapi_it_goes_on_and_counts():
    with running_bridge(bridge={"rosapi": False}) as bridge, Ridgeback(bridge.url, topics=QUICK) as base:
        assert base.health().counters["unanswered_checks"] == 5  # who listens, who commands, and three types
        assert base.command(FORWARD) == FORWARD
        assert until(lambda: base.drain() is not None and (0.1, 0.0, 0.0) in [e[1:] for e in bridge.heard()])


def test_pings_of_the_server_are_answered():
    with running_bridge(bridge={"ping_interval_s": 0.1, "ping_timeout_s": 0.4}) as bridge:
        idle = socket.create_connection(("127.0.0.1", int(bridge.url.rpartition(":")[2])))
        with Ridgeback(bridge.url, topics=QUICK) as base:
            for _ in range(60):  # commands would count as a sign of life, so none are sent
                base._receive()
                time.sleep(0.01)
            assert base.health().state == LinkState.UP
            assert bridge.report()["clients"] == 1  # the idle one was dropped: the rule works
        idle.close()


def test_plain_slashes_and_naggling_server():
    with (
        running_bridge(bridge={"escape_slashes": False, "nagle": True}) as bridge,
        Ridgeback(bridge.url, topics=QUICK) as base,
    ):
        assert gather_until(base, CommandEcho, FORWARD).value == CommandEcho(FORWARD)


@pytest.mark.long
def test_a_naggling_server_is_not_kept_waiting():
    """Acknowledged late, its next message would wait: some twenty in two seconds for more than 40 ms (measured)."""
    with running_bridge(bridge={"nagle": True}) as bridge, Ridgeback(bridge.url, topics=QUICK) as base:
        arrivals: set[int] = set()
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            arrivals |= {sample.received_ns for sample in base.drain()}
            time.sleep(0.001)
    late = [b - a for a, b in itertools.pairwise(sorted(arrivals)) if b - a > 35_000_000]
    assert len(late) < 8, late


def test_stop_and_close_are_idempotent_and_need_no_link():
    base = Ridgeback("ws://127.0.0.1:1")
    base.stop()
    base.close()
    base.close()
    assert base.drain() == ()
    assert base.command(FORWARD) == BodyTwist()
    assert base.fileno() == -1
    assert base.health().state == LinkState.CLOSED


def test_it_can_be_opened_again(bridge: Bridge):
    base = Ridgeback(bridge.url, topics=QUICK)
    for _ in range(2):
        with base:
            assert base.command(FORWARD) == FORWARD


@pytest.mark.parametrize("ahead_s", [0.0, 30.0, -7.25])
def test_the_offset_of_the_robot_s_clock_is_told_with_how_well_it_is_known(ahead_s):
    with running_bridge({}, {"clock_skew_s": ahead_s}) as bridge:
        base = Ridgeback(bridge.url, topics=TOPICS)
        try:
            offset = base.open().clock
        finally:
            base.close()
    assert offset is not None
    assert abs(offset.ahead_s - ahead_s) <= offset.within_s + 1e-6
    assert 0.0 < offset.within_s < 0.1


@pytest.mark.long
def test_without_rosapi_the_offset_of_the_clock_is_not_known():
    with running_bridge({}, {"rosapi": False}) as bridge:
        base = Ridgeback(bridge.url, topics=TOPICS)
        try:
            assert base.open().clock is None
        finally:
            base.close()
