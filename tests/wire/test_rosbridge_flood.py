"""More messages than can be read: no drain holds the gate up, and a backlog that lasts is a lost link.

A drain takes in at most 200 messages or 2 ms of processor time; after 0.2 s of backlog the link is reset.
"""

import socket
import threading
import time

import pytest
from websockets.client import ClientProtocol
from websockets.protocol import State

from robot_io.messages import BodyTwist, LinkState
from robot_io.ridgeback.driver import Ridgeback
from robot_io.ridgeback.open_socket import parse_url
from robot_io.ridgeback.websocket_link import WebSocketLink
from tests.robot_io.ridgeback.test_websocket_link import PING, TEXT, frame
from tests.wire.bridge_process import until

MS = 1_000_000


@pytest.fixture
def flooded():
    """Give a driver on an open link whose bridge sends what the test puts into `flood`, without end."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        ours = socket.create_connection(listener.getsockname())
        theirs, _ = listener.accept()
    flood: list[bytes] = []
    ended = threading.Event()

    def serve() -> None:
        theirs.settimeout(0.001)
        while not ended.is_set():
            for use in (lambda: theirs.send(flood[0]) if flood else None, lambda: theirs.recv(65536)):
                try:
                    use()
                except TimeoutError:
                    pass
                except OSError:
                    return

    thread = threading.Thread(target=serve)
    thread.start()
    ours.setblocking(False)
    url = "ws://127.0.0.1:1"
    base = Ridgeback(url)
    base._link = WebSocketLink(ours, ClientProtocol(parse_url(url), state=State.OPEN), time.monotonic_ns)
    base._started, base._state = True, LinkState.UP
    base.newest_inbound_ns = time.monotonic_ns()
    yield base, flood
    ended.set()
    base.close()
    thread.join(5)
    theirs.close()


@pytest.mark.parametrize(
    "message",
    [
        frame(TEXT, b""),
        frame(TEXT, b"{}"),
        frame(PING, b""),
        frame(TEXT, b'{"op":"publish","topic":"/other","msg":{}}'),
    ],
    ids=["empty", "tiny", "pings", "other topics"],
)
def test_a_flood_holds_no_drain_and_is_a_lost_link_after_a_while(flooded, message):
    base, flood = flooded
    flood.append(message * (262_144 // len(message)))
    longest_ns = most = 0

    def lost() -> bool:
        nonlocal longest_ns, most
        messages, began_ns = base.health().counters["messages"], time.thread_time_ns()
        base.drain()
        longest_ns = max(longest_ns, time.thread_time_ns() - began_ns)
        most = max(most, base.health().counters["messages"] - messages)
        base.command(BodyTwist(0.1, 0.0, 0.0))
        return base.health().state == LinkState.LOST

    assert until(lost, every_s=0.002)
    assert most <= 200
    assert longest_ns < 10 * MS  # 2 ms to read, 2 ms to decode, and what one step takes beyond that
    assert "0.2 s" in base.health().cause or "not reading" in base.health().cause
    assert base.fileno() == -1


def test_a_burst_that_ends_is_read_share_by_share(flooded):
    base, _ = flooded
    base._intake._undecoded.extend([(b'{"op":"x"}', time.monotonic_ns())] * 500)
    taken = []
    while base._intake._undecoded:
        before = base.health().counters["messages"]
        base.drain()
        taken.append(base.health().counters["messages"] - before)
    assert sum(taken) == 500
    assert max(taken) <= 200
    assert len(taken) >= 3
    base.drain()
    assert base._intake.behind_since_ns == 0
    assert base.health().state == LinkState.UP
