"""The websocket link against bytes written by hand (RFC 6455): what it takes, and how it ends."""

import socket
import struct
import time
from collections.abc import Iterator

import pytest
from websockets.client import ClientProtocol
from websockets.protocol import State

from robot_io.messages import BodyTwist, LinkState
from robot_io.ridgeback.driver import LINK_STALE_NS, Ridgeback
from robot_io.ridgeback.open_socket import parse_url
from robot_io.ridgeback.websocket_link import LinkLost, WebSocketLink

URL = "ws://127.0.0.1:1"
TEXT, CONTINUATION, CLOSE, PING = 1, 0, 8, 9


def frame(opcode: int, payload: bytes = b"", *, last: bool = True) -> bytes:
    """A frame of a server: not masked, at most 125 bytes."""
    return bytes([(0x80 if last else 0) | opcode, len(payload)]) + payload


GOODBYE = frame(CLOSE, struct.pack(">H", 1001) + b"shutdown")


@pytest.fixture
def ends() -> Iterator[tuple[WebSocketLink, socket.socket]]:
    """A link after the handshake, and the bridge's end of its socket."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        ours = socket.create_connection(listener.getsockname())
        theirs, _ = listener.accept()
    ours.setblocking(False)
    theirs.settimeout(2)
    link = WebSocketLink(ours, ClientProtocol(parse_url(URL), state=State.OPEN), time.monotonic_ns)
    with theirs:
        yield link, theirs
    link.abort()


def receive(link: WebSocketLink) -> list[bytes]:
    assert link.wait_readable(time.monotonic_ns() + 2_000_000_000)
    return [text for text, _ in link.receive()]


def test_a_text_in_parts_with_a_ping_between_them(ends):
    link, bridge = ends
    bridge.sendall(frame(TEXT, b"a", last=False) + frame(PING, b"?") + frame(CONTINUATION, b"b", last=False))
    assert receive(link) == []
    bridge.sendall(frame(CONTINUATION, b"c") + frame(TEXT, b"d"))
    assert receive(link) == [b"abc", b"d"]
    opcode, length, *mask_and_payload = bridge.recv(100)
    assert (opcode, length) == (0x8A, 0x81)  # a pong, masked, of one byte
    assert mask_and_payload[0] ^ mask_and_payload[4] == ord("?")


def test_a_goodbye_is_a_lost_link_that_names_it(ends):
    link, bridge = ends
    bridge.sendall(GOODBYE)
    with pytest.raises(LinkLost, match=r"closed by the bridge \(1001 shutdown\)"):
        receive(link)


def test_what_came_before_the_goodbye_is_still_returned_and_nothing_more_is_sent(ends):
    link, bridge = ends
    bridge.sendall(frame(TEXT, b"last words") + GOODBYE)
    assert receive(link) == [b"last words"]
    for use in (link.receive, lambda: link.send_text(b"{}"), lambda: link.send_ping(b"")):
        with pytest.raises(LinkLost, match="1001"):
            use()


def test_a_goodbye_that_came_with_the_handshake(ends):
    link, _ = ends
    link._protocol.receive_data(GOODBYE)
    for use in (link.receive, lambda: link.send_text(b"{}"), lambda: link.send_ping(b"")):
        with pytest.raises(LinkLost, match="1001"):
            use()


@pytest.mark.parametrize(
    "bad",
    [
        frame(CONTINUATION, b"of nothing"),
        frame(3, b"no such opcode"),
        b"\x81\x80....",  # masked, as only clients may
        b"\xc1\x01a",  # compressed, which nobody agreed on
        frame(PING, b"", last=False),
        b"\x81\x7f" + struct.pack(">Q", 2**40),  # a terabyte is coming
    ],
)
def test_a_broken_frame_is_a_lost_link(ends, bad):
    link, bridge = ends
    bridge.sendall(bad)
    with pytest.raises(LinkLost, match="no valid websocket frame"):
        receive(link)


@pytest.mark.parametrize("last_stderr_line", [b"", frame(TEXT, b"last words")])
def test_the_driver_says_so_and_raises_nothing(ends, last_stderr_line):
    link, bridge = ends
    base = Ridgeback(URL)
    base._link, base._started, base._state = link, True, LinkState.UP
    base.newest_inbound_ns = time.monotonic_ns()
    bridge.sendall(last_stderr_line + GOODBYE)
    assert link.wait_readable(time.monotonic_ns() + 2_000_000_000)
    base.drain()
    assert base.command(BodyTwist(0.1, 0.0, 0.0)) == BodyTwist()
    assert base.health().state == LinkState.LOST
    assert "1001" in base.health().cause
    base.stop()
    base.close()


@pytest.mark.parametrize(("quiet_ns", "moves"), [(69_999_999, True), (70_000_000, True), (70_000_001, False)])
def test_nothing_that_moves_leaves_on_a_link_that_was_quiet_for_70_ms(ends, quiet_ns, moves):
    link, _ = ends
    now_ns = time.monotonic_ns()
    base = Ridgeback(URL, clock=lambda: now_ns)
    base._link, base._started, base._state = link, True, LinkState.UP
    base.newest_inbound_ns = now_ns - quiet_ns
    twist = BodyTwist(0.1, 0.0, 0.0)
    assert base.command(twist) == (twist if moves else BodyTwist())
    assert base.health().counters["held_back"] == (0 if moves else 1)
    assert base.command(BodyTwist()) == BodyTwist()
    assert base.health().counters["held_back"] == (0 if moves else 1), "a zero is never held back"
    assert base.health().counters["sent"] == 2


def test_a_link_on_which_nobody_has_looked_is_not_quiet(ends):
    """A message waits in the socket: whoever has not drained for 150 ms still drives."""
    link, bridge = ends
    bridge.sendall(frame(TEXT, b'{"op":"publish","topic":"/somebody","msg":{}}'))
    assert link.wait_readable(time.monotonic_ns() + 2_000_000_000)
    base = Ridgeback(URL)
    base._link, base._started, base._state = link, True, LinkState.UP
    base.newest_inbound_ns = time.monotonic_ns() - 150_000_000
    assert base.command(BodyTwist(0.1, 0.0, 0.0)) == BodyTwist(0.1, 0.0, 0.0)


def test_a_wait_ends_in_time_however_much_still_comes(ends):
    link, bridge = ends
    bridge.sendall(frame(TEXT, b"more"))
    assert link.wait_readable(time.monotonic_ns() + 2_000_000_000)
    assert not link.wait_readable(time.monotonic_ns())


def test_a_pause_of_this_process_right_after_reading_is_no_silence_of_the_bridge(ends):
    link, _ = ends
    now_ns = [time.monotonic_ns()]
    base = Ridgeback(URL, clock=lambda: now_ns[0])
    base._link, base._started, base._state = link, True, LinkState.UP
    base.newest_inbound_ns = now_ns[0]
    read = link.receive

    def read_and_be_frozen() -> list[tuple[bytes, int]]:
        texts = read()
        now_ns[0] += LINK_STALE_NS + 1
        return texts

    link.receive = read_and_be_frozen
    base.drain()
    assert base.health().state == LinkState.UP  # what has come meanwhile is read next time
    base.drain()
    assert base.health().state == LinkState.LOST


def test_a_wait_in_which_nothing_comes_is_not_cut_short(ends):
    """Also by less than a millisecond, in which poll(2) counts."""
    link, _ = ends
    for _ in range(5):
        until_ns = time.monotonic_ns() + 1_900_000
        assert not link.wait_readable(until_ns)
        assert time.monotonic_ns() >= until_ns
