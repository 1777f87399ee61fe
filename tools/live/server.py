"""The process of the live view: `python -m tools.live.server` (job on stdin). Ends when its feed has ended.

It serves the messages of a log over the Foxglove websocket protocol, by the library of Foxglove itself, on loopback
only. That library queues messages for each viewer and drops the oldest beyond a limit. Topics that are said once
(`/robot_description`) are said again to a viewer that comes later.
"""

from __future__ import annotations

import logging
import signal
import socket
import sys
from collections import deque

import foxglove
import msgspec
from foxglove.websocket import ChannelView, Client, ServerListener

from robot_io.errors import EnvironmentFault
from robot_io.ipc.process import die_with_parent
from robot_io.ipc.status import StatusPipe
from robot_io.log.channels import BY_TOPIC
from robot_io.mcap.log_file import MESSAGE_ENCODING, SCHEMA_ENCODING
from tools.live.feed import LiveMessage, unpacked
from tools.live.job import LiveJob

HOST = "127.0.0.1"
PACKET_BYTES = 1 << 20
POLL_S = 0.1
BACKLOG = 8192
"""Messages that wait for a viewer, of about 2000 a second: a log that is followed comes in bursts."""
BEHIND = "foxglove.websocket.connected_client.send_lossy"
"""Where the library says that a viewer's queue is full."""


class Subscriptions(ServerListener):
    """Collects the topics that a viewer has asked for; called by threads of the library."""

    def __init__(self) -> None:
        self.topics: deque[str] = deque()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Note it."""
        self.topics.append(channel.topic)


class SlowViewer(logging.Handler):
    """Says once that a viewer misses messages."""

    def __init__(self, status: StatusPipe) -> None:
        super().__init__(logging.INFO)
        self._status = status
        self.noticed = False

    def emit(self, record: logging.LogRecord) -> None:
        """Say it."""
        if record.name == BEHIND and not self.noticed:
            self.noticed = True
            self._status.say("warning", text="a viewer of the live view does not keep up: it misses messages")


class LiveServer:
    """Publishes messages; a channel is declared with its first one. Raises RuntimeError where it cannot listen."""

    def __init__(self, port: int) -> None:
        self._asked = Subscriptions()
        self._server = foxglove.start_server(
            name="single-point-push", host=HOST, port=port, server_listener=self._asked, message_backlog_size=BACKLOG
        )
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[str, LiveMessage] = {}
        self.served = 0

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._server.port

    def publish(self, message: LiveMessage) -> None:
        """Give a message to all viewers of its topic."""
        channel = self._channels.get(message.topic)
        if channel is None:
            channel = self._channels[message.topic] = _channel(message.topic)
        if BY_TOPIC[message.topic].latched:
            self._latched[message.topic] = message
        channel.log(message.payload, log_time=message.log_time_ns)
        self.served += 1

    def greet(self) -> None:
        """Say once more what new viewers have missed."""
        while self._asked.topics:
            if (message := self._latched.get(self._asked.topics.popleft())) is not None:
                self.publish(message)

    def stop(self) -> None:
        """Close all connections."""
        self._server.stop()


def _channel(topic: str) -> foxglove.Channel:
    kind = BY_TOPIC[topic].cdr_type
    schema = foxglove.Schema(name=kind.name, encoding=SCHEMA_ENCODING, data=kind.schema_text.encode())
    return foxglove.Channel(topic, schema=schema, message_encoding=MESSAGE_ENCODING)


def serve(server: LiveServer, feed: socket.socket) -> None:
    """Publish all that the feed brings, until it ends."""
    feed.settimeout(POLL_S)
    while True:
        try:
            packet = feed.recv(PACKET_BYTES)
        except TimeoutError:
            packet = None
        if packet == b"":
            return
        for message in unpacked(packet or b""):
            server.publish(message)
        server.greet()


def main() -> int:
    """Serve until the feed ends; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=LiveJob)
    die_with_parent(job.parent_pid, signal.SIGTERM)
    status = StatusPipe(job.status_fd)
    slow = SlowViewer(status)
    foxglove.set_log_level("INFO")
    logging.getLogger("foxglove").setLevel(logging.INFO)
    logging.getLogger("foxglove").addHandler(slow)
    try:
        server = LiveServer(job.port)
    except Exception as error:  # the library's own, of no common type
        fault = EnvironmentFault(f"the live view cannot listen ({error})", where=f"{HOST}:{job.port}")
        status.error(fault)
        return fault.exit_code
    status.say("ready", url=f"ws://{HOST}:{server.port}")
    serve(server, socket.socket(fileno=job.feed_fd))
    server.stop()
    status.say("finished", served=server.served, slow_viewer=slow.noticed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
