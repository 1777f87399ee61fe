"""The live view's process, seen by a viewer that is not of its library."""

import contextlib
import signal

import pytest

from robot_io.errors import EnvironmentFault, UsageError
from robot_io.log.ros_messages import Header, String, Vector3, Wrench, WrenchStamped, ros_time
from tests.tools.live.viewer import Viewer, free_port
from tools.live import view
from tools.live.feed import LiveFeed
from tools.live.view import check_live, start_live, where_words
from tools.log.tick_topics import message

ZERO = Vector3(0.0, 0.0, 0.0)


def wrench(at_ns, fx):
    return message(
        "/ft/wrench", at_ns, WrenchStamped(Header(ros_time(at_ns), "world"), Wrench(Vector3(fx, 0.0, 0.0), ZERO))
    )


@contextlib.contextmanager
def live():
    port = free_port()
    child, to_view = start_live(port)
    assert child.ready is not None, child.errors
    assert where_words(child) == f"live view: ws://127.0.0.1:{port} (Foxglove, Lichtblick)"
    feed = LiveFeed(to_view)
    try:
        yield port, child, feed
    finally:
        feed.close()
        child.end(5.0)
        child.close()


def test_a_viewer_decodes_what_is_fed_by_the_schema_that_it_is_given():
    with live() as (port, _, feed):
        feed.add(*wrench(5, 0.5))
        feed.flush()
        with Viewer(port) as viewer:
            viewer.subscribe("/ft/wrench")
            for at_ns in range(1000, 1_000_000):  # until the subscription has arrived
                feed.add(*wrench(at_ns, at_ns / 8))
                feed.flush()
                viewer._socket.settimeout(0.05)
                with contextlib.suppress(Exception):
                    topic, log_time_ns, value = viewer.message()
                    break
        assert topic == "/ft/wrench"
        assert value.wrench.force.x == log_time_ns / 8
        assert value.header.frame_id == "world"


def test_a_viewer_that_comes_late_is_told_what_was_said_once():
    with live() as (port, _, feed):
        feed.add(*message("/robot_description", 7, String("<robot/>")))
        feed.flush()
        with Viewer(port) as viewer:
            viewer.subscribe("/robot_description")
            assert viewer.message()[0] == "/robot_description"
        with Viewer(port) as second:
            second.subscribe("/robot_description")
            assert second.message()[2].data == "<robot/>"


def test_it_ends_with_its_feed_and_says_how_much_it_served():
    with live() as (_, child, feed):
        feed.add(*wrench(1, 0.0))
        feed.flush()
        feed.close()
        child.end(10.0)
        child.hear()
        assert child.finished == {"event": "finished", "served": 1, "slow_viewer": False}


def test_a_viewer_that_never_reads_is_told_of_and_holds_nothing_up():
    with live() as (port, child, feed), Viewer(port) as viewer:
        events = []
        large = message("/ft/wrench", 1, WrenchStamped(Header(ros_time(1), "x" * 3000), Wrench(ZERO, ZERO)))
        feed.add(*large)
        feed.flush()
        viewer.subscribe("/ft/wrench")
        while not any(event["event"] == "warning" for event in events):  # ends by the test's own limit
            feed.add(*large)
            feed.flush()
            events += child.hear()
        assert "does not keep up" in events[-1]["text"]
        with Viewer(port) as other:
            other.subscribe("/ft/wrench")


def test_its_death_is_noticed_by_the_next_message_and_by_nothing_else():
    with live() as (_, child, feed):
        child.process.send_signal(signal.SIGKILL)
        child.end(5.0)
        feed.add(*wrench(1, 0.0))
        feed.flush()
        assert feed.counts() == {"sent": 0, "dropped": 1}


def test_without_the_extra_one_sentence_has_the_line_for_pip(monkeypatch):
    monkeypatch.setattr(view.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(EnvironmentFault, match="foxglove-sdk") as caught:
        check_live(free_port())
    assert "pip install" in caught.value.do


def test_a_port_that_is_taken_is_refused_before_anything_starts():
    with live() as (port, _, _), pytest.raises(EnvironmentFault, match="cannot listen") as caught:
        check_live(port)
    assert "--live-port" in caught.value.do


def test_a_run_faster_than_the_clock_is_not_shown():
    with pytest.raises(UsageError, match="--fast"):
        check_live(free_port(), fast=True)
