"""A viewer for tests: speaks the Foxglove websocket protocol by `websocket-client`, decodes by `mcap-ros2-support`.

Neither is the library that serves; formats are those of the protocol's specification.
"""

import json
import socket
import struct
import time

import websocket
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

PROTOCOL = "foxglove.sdk.v1"
MESSAGE_DATA = 1


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Viewer:
    def __init__(self, port, within_s=20.0):
        deadline_s = time.monotonic() + within_s
        while True:
            try:
                self._socket = websocket.create_connection(
                    f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], timeout=within_s
                )
                break
            except OSError:
                assert time.monotonic() < deadline_s, "nothing listens"
                time.sleep(0.05)
        self.channels = {}
        self._topics = {}
        self._waiting = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def subscribe(self, topic, within_s=30.0):
        """Wait until the topic is offered, and subscribe to it."""
        deadline_s = time.monotonic() + within_s
        while topic not in self.channels:
            assert time.monotonic() < deadline_s, f"{topic} is not offered, only {sorted(self.channels)}"
            data = self._socket.recv()
            self._text(data) if isinstance(data, str) else self._waiting.append(data)
        number = len(self._topics) + 1
        self._topics[number] = topic
        wanted = [{"id": number, "channelId": self.channels[topic]["id"]}]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def message(self):
        """Return the next message: topic, log time (ns), decoded by the schema that the server gave."""
        while True:
            data = self._waiting.pop(0) if self._waiting else self._socket.recv()
            if isinstance(data, str):
                self._text(data)
                continue
            kind, number, log_time_ns = struct.unpack_from("<BIQ", data)
            assert kind == MESSAGE_DATA
            topic = self._topics[number]
            return topic, log_time_ns, self._decoder(topic)(data[13:])

    def _decoder(self, topic):
        channel = self.channels[topic]
        assert channel["encoding"] == "cdr"
        schema = Schema(
            id=1, name=channel["schemaName"], encoding=channel["schemaEncoding"], data=channel["schema"].encode()
        )
        decode = DecoderFactory().decoder_for("cdr", schema)
        assert decode is not None
        return decode

    def _text(self, data):
        assert data, "the server has closed the connection"
        said = json.loads(data)
        if said["op"] == "advertise":
            self.channels |= {channel["topic"]: channel for channel in said["channels"]}
