"""The emulated bridge against conversations with a real rosbridge, kept as text in tests/golden."""

import json
import time
from pathlib import Path

import pytest
import websocket

from tests.wire.bridge_process import running_bridge, until

GOLDEN = Path(__file__).parents[1] / "golden"


def fits(expected, got) -> bool:
    if expected == "*":
        return True
    if isinstance(expected, dict) and isinstance(got, dict):
        return expected.keys() == got.keys() and all(fits(value, got[key]) for key, value in expected.items())
    return bool(expected == got and type(expected) is type(got))


@pytest.fixture(scope="module")
def bridge():
    with running_bridge() as running:
        yield running


@pytest.mark.parametrize("path", sorted(GOLDEN.glob("rosbridge_*.txt")), ids=lambda path: path.stem)
def test_conversation(bridge, path: Path):
    before = len(bridge.heard())
    client = websocket.create_connection(bridge.url, timeout=2)
    try:
        heard = talk(client, path)
        assert until(lambda: len(bridge.heard()) - before >= len(heard))
        assert [tuple(entry[1:]) for entry in bridge.heard()[before:]] == heard
    finally:
        client.close()
        client.shutdown()


def talk(client: websocket.WebSocket, path: Path) -> list[tuple[float, ...]]:
    """Follow the file; return what the base must have heard."""
    heard = []
    for line in path.read_text().splitlines():
        kind, _, text = line.partition(" ")
        if kind == ">":
            client.send(text)
        elif kind == "<":
            got = json.loads(client.recv())
            assert fits(json.loads(text), got), f"{line}\ngot {got}"
        elif kind == "silence":
            client.settimeout(0.2)
            with pytest.raises(websocket.WebSocketTimeoutException):
                client.recv()
            client.settimeout(2)
        elif kind == "heard":
            heard += [tuple(float(part) for part in text.split())] if text else []
        else:
            assert kind == "#", line
    return heard


def test_a_stamp_in_the_other_ros_spelling_is_the_time_of_arrival(bridge):
    client = websocket.create_connection(bridge.url, timeout=2)
    client.send('{"op":"advertise","topic":"/there","type":"geometry_msgs/PoseStamped"}')
    client.send('{"op":"subscribe","topic":"/there"}')
    client.send('{"op":"publish","topic":"/there","msg":{"header":{"stamp":{"sec":5,"nanosec":6}}}}')
    stamp = json.loads(client.recv())["msg"]["header"]["stamp"]
    assert stamp["secs"] == pytest.approx(time.time(), abs=2)
    client.close()
    client.shutdown()
