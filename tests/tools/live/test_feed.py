"""The sending end of the live view never waits, and counts what it drops."""

import socket

import pytest

from tools.live.feed import LiveFeed, unpacked


@pytest.fixture
def link():
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    feed = LiveFeed(near)
    yield feed, far
    feed.close()
    far.close()


def received(far):
    far.setblocking(False)
    found = []
    try:
        while packet := far.recv(1 << 20):
            found += unpacked(packet)
    except BlockingIOError:
        return found
    return found


def test_messages_arrive_in_order_as_they_were(link):
    feed, far = link
    for i in range(5):
        feed.add("/ft/wrench", 1000 + i, bytes([i]) * i)
    feed.flush()
    assert [tuple(message) for message in received(far)] == [("/ft/wrench", 1000 + i, bytes([i]) * i) for i in range(5)]
    assert feed.counts() == {"sent": 5, "dropped": 0}


def test_a_reader_that_never_reads_costs_drops_and_no_wait(link):
    feed, far = link
    for i in range(100_000):
        feed.add("/ft/wrench", i, bytes(100))
    feed.flush()
    counts = feed.counts()
    assert counts["dropped"] > 50_000
    assert counts["sent"] + counts["dropped"] == 100_000
    assert len(received(far)) == counts["sent"]


def test_what_is_said_once_is_not_lost_to_a_slow_reader(link):
    feed, far = link
    while feed.dropped == 0:
        feed.add("/ft/wrench", 1, bytes(1000))
        feed.flush()
    feed.add("/robot_description", 2, b"urdf")
    feed.add("/ft/wrench", 3, b"")
    feed.flush()
    assert not [message for message in received(far) if message.topic == "/robot_description"]
    feed.add("/ft/wrench", 4, b"")
    feed.flush()
    assert [tuple(message) for message in received(far)] == [
        ("/robot_description", 2, b"urdf"),
        ("/ft/wrench", 4, b""),
    ]


def test_a_reader_that_has_gone_is_forgotten(link):
    feed, far = link
    far.close()
    for _ in range(3):
        feed.add("/ft/wrench", 1, b"x")
        feed.flush()
    assert feed.counts() == {"sent": 0, "dropped": 3}


def test_a_message_larger_than_any_packet_is_dropped_alone(link):
    feed, far = link
    feed.add("/robot_description", 1, bytes(8 << 20))
    feed.flush()
    feed.add("/ft/wrench", 2, b"x")
    feed.flush()
    assert [message.log_time_ns for message in received(far)] == [2]
    assert feed.counts() == {"sent": 1, "dropped": 1}
