"""Nobody else commands the base, and our zeros come back: checked before anything moves, and told later on.

The command topic is listened to for 0.3 s before the first message; a zero has to be heard back within 2 s.
"""

import contextlib
import json
import threading
import time
from collections.abc import Iterator

import pytest
import websocket

from robot_io.errors import DeviceNotReady
from robot_io.messages import BodyTwist, CommandEcho
from robot_io.ridgeback.driver import Ridgeback
from robot_io.ridgeback.echo_watch import EchoWatch
from robot_io.ridgeback.preflight import Answers
from robot_io.ridgeback.rosbridge_codec import decode_publishers
from robot_io.rig.topics import TopicsConfig
from tests.safety.test_gate_alone import Gate
from tests.wire.bridge_process import Bridge, running_bridge, until

TOPICS = TopicsConfig(status="")  # the status comes once a second, and start waits for it
ZERO, OURS, THEIRS = BodyTwist(), BodyTwist(0.1, 0.0, 0.0), BodyTwist(0.0, 0.02, 0.0)
MS = 1_000_000


@pytest.fixture
def bridge():
    with running_bridge() as running:
        yield running


@contextlib.contextmanager
def somebody_else(bridge: Bridge, twist: BodyTwist | None) -> Iterator[None]:
    """Another client of the bridge that advertises the command topic, and publishes 20 times a second unless None."""
    client = websocket.create_connection(bridge.url, timeout=1)
    client.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/Twist"}))
    ended = threading.Event()

    def publish() -> None:
        while twist is not None and not ended.wait(0.05):
            linear = {"x": twist.vx, "y": twist.vy, "z": 0.0}
            client.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": linear}}))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        client.close()


def test_alone_it_takes_command_with_zeros_only(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        began_ns = time.monotonic_ns()
        assert bridge.heard() == []
        base.take_command()
        took_ns = time.monotonic_ns() - began_ns
        heard = bridge.heard()
        assert 300 * MS <= took_ns < 2_300 * MS
        assert heard[0][0] - began_ns >= 300 * MS  # it has listened first
        assert {entry[1:] for entry in heard} == {(0.0, 0.0, 0.0)}
        assert base.command(OURS) == OURS


def test_a_velocity_of_somebody_else_refuses_the_start(bridge: Bridge):
    with somebody_else(bridge, THEIRS), Ridgeback(bridge.url, topics=TOPICS) as base:
        with pytest.raises(DeviceNotReady, match=r"somebody else commands the base: 0\.00 m/s forward, 0\.02 m/s left"):
            base.take_command()
        assert base.health().counters["sent"] == 0
    assert {entry[1:] for entry in bridge.heard()[:-3]} == {(0.0, 0.02, 0.0)}


def test_one_that_only_might_is_no_reason(bridge: Bridge):
    with somebody_else(bridge, None), Ridgeback(bridge.url, topics=TOPICS) as base:
        base.take_command()


def test_zeros_that_do_not_come_back_refuse_the_start(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base:
        bridge.do("stop_reading", 30.0)  # feeds still come
        began_ns = time.monotonic_ns()
        with pytest.raises(DeviceNotReady, match="none of our zero velocities was heard back within 2 s"):
            base.take_command()
        assert 2_300 * MS <= time.monotonic_ns() - began_ns < 3_500 * MS


def test_the_gate_refuses_to_start_beside_somebody_else(bridge: Bridge):
    with somebody_else(bridge, THEIRS), contextlib.closing(Gate(bridge.url)) as gate:
        assert until(lambda: bool(gate.child.hear()) or bool(gate.child.errors), seconds=10.0)
        assert "somebody else commands the base" in gate.child.errors[0].what
        assert gate.child.ready is None


def test_the_gate_names_somebody_else_who_comes_later(bridge: Bridge):
    with contextlib.closing(Gate(bridge.url)) as gate:
        gate.wait_ready()
        said: list[str] = []

        def told() -> bool:
            said.extend(event["text"] for event in gate.child.hear() if event["event"] == "warning")
            return bool(said)

        gate.tell_for(ZERO, 50)
        with somebody_else(bridge, THEIRS):
            gate.tell_until(ZERO, told)
        gate.tell_for(ZERO, 100)
        told()
    want = "somebody else commands the base as well: 0.00 m/s forward, 0.02 m/s left, 0.00 rad/s was heard"
    assert said == [want]  # once


def test_every_velocity_heard_is_ours_or_not(bridge: Bridge):
    with Ridgeback(bridge.url, topics=TOPICS) as base, somebody_else(bridge, THEIRS):
        echoes: list[CommandEcho] = []

        def both() -> bool:
            base.command(OURS)
            echoes.extend(sample.value for sample in base.drain() if isinstance(sample.value, CommandEcho))
            return {echo.ours for echo in echoes} == {True, False}

        assert until(both)
    assert {echo.twist for echo in echoes if echo.ours} == {OURS}
    assert {echo.twist for echo in echoes if not echo.ours} == {THEIRS}


def test_an_echo_within_rounding_is_ours_and_clears_what_is_unheard():
    watch = EchoWatch()
    assert not watch.on_heard(ZERO)  # nothing was sent yet
    watch.on_sent(OURS, 5)
    assert watch.unheard_since_ns == 0  # before the first echo, ROS may still be connecting
    assert watch.on_heard(BodyTwist(0.1 + 9e-10, 0.0, 0.0))
    assert not watch.on_heard(BodyTwist(0.1 + 2e-9, 0.0, 0.0))
    watch.on_sent(OURS, 7)
    watch.on_sent(ZERO, 9)
    assert watch.unheard_since_ns == 7
    assert not watch.on_heard(THEIRS)
    assert (watch.unheard_since_ns, watch.foreign, watch.newest_foreign) == (7, 3, THEIRS)
    assert watch.on_heard(OURS)
    assert (watch.unheard_since_ns, watch.heard) == (0, 2)


def test_what_an_operator_should_know():
    assert Answers((), 5, ()).remarks("/cmd_vel") == ()
    (unanswered,) = Answers(("subscribers", "type:/odom"), 5, ()).remarks("/cmd_vel")
    assert "2 of 5 questions unanswered" in unanswered
    assert Answers((), 5, ("/teleop", "/nav")).remarks("/cmd_vel") == (
        "/teleop, /nav may command the base, too, on /cmd_vel",
    )
    assert decode_publishers(b'{"publishers": ["/teleop"]}') == ["/teleop"]


@pytest.mark.long
def test_without_rosapi_that_is_said():
    with running_bridge(bridge={"rosapi": False}) as bridge, contextlib.closing(Ridgeback(bridge.url)) as base:
        (remark,) = base.open().remarks
        assert "rosapi left 6 of 6 questions unanswered" in remark  # who listens, who commands, and four types
