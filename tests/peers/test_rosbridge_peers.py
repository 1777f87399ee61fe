"""The emulated bridge as a client nobody here wrote meets it: the `websocket-client` library, plain JSON.

What a real rosbridge (0.11.17) does in each case is in its protocol document and source, or was measured.
"""

import itertools
import json
import math
import socket
import time

import pytest
import websocket

from robot_io.rig.topics import TopicsConfig
from tests.wire.bridge_process import Bridge, running_bridge, until

POSE_TOPIC = "/vicon/ThingBase_4/ThingBase_4"


class Client:
    """A plain rosbridge client: sends objects, reads objects."""

    def __init__(self, bridge: Bridge, **options) -> None:
        self.socket = websocket.create_connection(bridge.url, timeout=2, **options)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.socket.shutdown()  # close() leaves the descriptor open when the server said goodbye first

    def send(self, **request):
        self.socket.send(json.dumps(request))

    def read(self) -> dict:
        return json.loads(self.socket.recv())

    def call(self, service, arguments=None, call_id="c1"):
        self.send(op="call_service", id=call_id, service=service, args=arguments if arguments is not None else {})
        while (answer := self.read()).get("op") != "service_response" or answer.get("id") != call_id:
            pass
        return answer

    def read_topic(self, topic):
        while (message := self.read()).get("topic") != topic:
            pass
        return message["msg"]

    def nothing_comes(self, seconds=0.2) -> bool:
        """After a service call and back nothing else has come: the bridge stayed silent."""
        self.socket.settimeout(seconds)
        try:
            self.socket.recv()
        except websocket.WebSocketTimeoutException:
            return True
        finally:
            self.socket.settimeout(2)
        return False


@pytest.fixture(scope="module")
def bridge():
    with running_bridge() as running:
        yield running


@pytest.fixture
def client(bridge):
    with Client(bridge) as connected:
        yield connected


def heard_since(bridge: Bridge, count: int):
    return [tuple(entry[1:]) for entry in bridge.heard()[count:]]


def test_handshake_says_autobahn_and_takes_any_path(bridge: Bridge):
    other = websocket.create_connection(bridge.url + "/any/path?x=1", timeout=2)
    assert other.getheaders()["server"].startswith("AutobahnPython/")
    other.close()


def test_subscribe_gives_the_transform_of_the_wire_facts(client: Client):
    client.send(op="subscribe", id="s", topic=POSE_TOPIC, type="geometry_msgs/TransformStamped", throttle_rate=0)
    first = client.read_topic(POSE_TOPIC)
    assert list(first) == ["header", "child_frame_id", "transform"]
    assert set(first["header"]) == {"seq", "stamp", "frame_id"}
    assert set(first["header"]["stamp"]) == {"secs", "nsecs"}
    assert first["child_frame_id"] == "vicon/ThingBase_4/ThingBase_4"
    assert first["transform"]["rotation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    assert first["header"]["stamp"]["secs"] == pytest.approx(time.time(), abs=2)
    assert client.read_topic(POSE_TOPIC)["header"]["seq"] == first["header"]["seq"] + 1
    client.send(op="unsubscribe", id="s", topic=POSE_TOPIC)
    client.call("/rosapi/get_time")
    assert client.nothing_comes()


def test_rates_of_the_feeds(client: Client):
    topics = {
        POSE_TOPIC: ("geometry_msgs/TransformStamped", 100),
        "/ridgeback/joint_states": ("sensor_msgs/JointState", 100),
        "/odometry/filtered": ("nav_msgs/Odometry", 50),
        "/ridgeback_velocity_controller/odom": ("nav_msgs/Odometry", 25),
    }
    for topic, (type_name, _) in topics.items():
        client.send(op="subscribe", topic=topic, type=type_name)
    stamps: dict[str, list[float]] = {topic: [] for topic in topics}
    end = time.monotonic() + 1.2
    while time.monotonic() < end:
        message = client.read()
        stamp = message["msg"]["header"]["stamp"]
        stamps[message["topic"]].append(stamp["secs"] + stamp["nsecs"] * 1e-9)
    for topic, (_, rate) in topics.items():
        series = stamps[topic]
        assert (len(series) - 1) / (series[-1] - series[0]) == pytest.approx(rate, rel=0.005), topic


def test_slashes_are_escaped_on_the_wire(client: Client):
    client.send(op="subscribe", topic=POSE_TOPIC)
    assert '"topic":"\\/vicon\\/ThingBase_4\\/ThingBase_4"' in client.socket.recv()


def test_publish_reaches_the_base_and_comes_back_as_echo(bridge: Bridge, client: Client):
    count = len(bridge.heard())
    client.send(op="advertise", topic="/cmd_vel", type="geometry_msgs/Twist", queue_size=1)
    client.send(op="subscribe", topic="/cmd_vel", type="geometry_msgs/Twist")
    client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1, "z": 7}, "angular": {"z": -1}})
    assert client.read_topic("/cmd_vel") == {
        "linear": {"x": 0.1, "y": 0.0, "z": 7.0},
        "angular": {"x": 0.0, "y": 0.0, "z": -1.0},
    }
    assert until(lambda: heard_since(bridge, count) == [(0.1, 0.0, -1.0)])
    client.send(op="publish", topic="/cmd_vel")  # no msg at all: a zero twist
    assert until(lambda: heard_since(bridge, count)[-1] == (0.0, 0.0, 0.0))


def test_nan_goes_through_and_comes_back_as_null():
    with running_bridge() as bridge, Client(bridge) as client:
        client.send(op="subscribe", topic="/cmd_vel")
        client.socket.send('{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":NaN,"y":1e999}}}')
        text = client.socket.recv()
        assert '"x":null,"y":null' in text
        heard = bridge.heard()[-1]
        assert math.isnan(heard[1])
        assert heard[2] == math.inf
        assert until(lambda: bridge.report()["velocity"][0] == pytest.approx(-0.1))  # backwards


def test_direct_topic_passes_the_lock_and_the_mux(bridge: Bridge, client: Client):
    client.send(op="publish", topic="/e_stop", msg={"data": True})
    count = len(bridge.heard())
    client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
    client.send(op="publish", topic="/ridgeback_velocity_controller/cmd_vel", msg={"linear": {"x": 0.2}})
    assert until(lambda: heard_since(bridge, count) == [(0.2, 0.0, 0.0)])
    client.send(op="publish", topic="/e_stop", msg={"data": False})
    client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
    assert until(lambda: heard_since(bridge, count)[-1] == (0.1, 0.0, 0.0))


def test_services(client: Client):
    assert client.call("/rosapi/topic_type", {"topic": "/cmd_vel"}) == {
        "op": "service_response",
        "service": "/rosapi/topic_type",
        "values": {"type": "geometry_msgs/Twist"},
        "result": True,
        "id": "c1",
    }
    assert client.call("/rosapi/topic_type", {"topic": "/nobody"})["values"] == {"type": ""}
    assert client.call("/rosapi/topic_type", ["/cmd_vel"])["values"] == {"type": "geometry_msgs/Twist"}
    assert client.call("/rosapi/subscribers", {"topic": "/cmd_vel"})["values"]["subscribers"] == ["/twist_mux"]
    assert "/vicon_bridge" in client.call("/rosapi/publishers", {"topic": POSE_TOPIC})["values"]["publishers"]
    assert client.call("/rosapi/get_time")["values"]["time"]["secs"] == pytest.approx(time.time(), abs=2)
    topics = client.call("/rosapi/topics")["values"]
    assert dict(zip(topics["topics"], topics["types"], strict=True))["/mcu/status"] == "ridgeback_msgs/Status"
    failed = client.call("/nope", call_id="s3")
    assert failed["result"] is False
    assert isinstance(failed["values"], str)
    assert failed["id"] == "s3"


def test_services_that_lists_and_viewers_ask(client: Client):
    """roslibjs and roslibpy list nodes and services so; viewers ask for the definitions of all types."""
    nodes = client.call("/rosapi/nodes")["values"]["nodes"]
    assert {"/twist_mux", "/vicon_bridge", "/rosbridge_websocket", "/rosapi"} <= set(nodes)
    assert "/rosapi/topics" in client.call("/rosapi/services")["values"]["services"]
    assert client.call("/rosapi/service_type", {"service": "/rosapi/topic_type"})["values"] == {
        "type": "rosapi/TopicType"
    }
    assert client.call("/rosapi/service_type", {"service": "/nope"})["values"] == {"type": ""}
    assert client.call("/rosapi/topics_for_type", {"type": "ridgeback_msgs/Status"})["values"] == {
        "topics": ["/mcu/status"]
    }
    assert client.call("/rosapi/get_param", {"name": "/rosdistro", "default": '"noetic"'})["values"] == {
        "value": '"noetic"'
    }
    raw = client.call("/rosapi/topics_and_raw_types")["values"]
    texts = dict(zip(raw["types"], raw["typedefs_full_text"], strict=True))
    assert texts["geometry_msgs/Twist"] == (
        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n\n" + "=" * 80 + "\n"
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    )
    assert texts["nav_msgs/Odometry"].count("MSG: ") == 8


@pytest.mark.parametrize(
    "text",
    [
        '{"op":"advertise","topic":"/cmd_vel","type":"geometry_msgs/TwistStamped"}',
        '{"op":"advertise","topic":"/new","type":"geometry_msgs/msg/Twist"}',
        '{"op":"advertise","topic":"/new","type":"no_msgs/Such"}',
        '{"op":"advertise","topic":"/new"}',
        '{"op":"publish","topic":"/never_heard_of","msg":{}}',
        '{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":"0.1"}}}',
        '{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":true}}}',
        '{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":null}}}',
        '{"op":"publish","topic":"/cmd_vel","msg":{"speed":0.1}}',
        '{"op":"publish","topic":"/cmd_vel","msg":null}',
        '{"op":"subscribe","topic":"/vicon/ThingBase_4/ThingBase_4","throttle_rate":10.0}',
        '{"op":"subscribe","topic":"/vicon/ThingBase_4/ThingBase_4","type":"nav_msgs/Odometry"}',
        '{"op":"subscribe","topic":"/nowhere"}',
        '{"op":"set_level","level":"info"}',
        '{"op":"dance"}',
        '{"noop":1}',
        "[1,2,3]",
        "hello",
    ],
)
def test_silence_on_every_error_and_the_next_message_works(bridge: Bridge, text):
    count = len(bridge.heard())
    with Client(bridge) as client:
        client.socket.send(text)
        assert client.call("/rosapi/topic_type", {"topic": "/cmd_vel"})["result"] is True  # first and only answer
        assert client.nothing_comes(0.05)
        client.send(op="publish", topic="/cmd_vel", msg={"linear": {"y": 0.03}})
        assert until(lambda: heard_since(bridge, count) == [(0.0, 0.03, 0.0)])


def test_a_message_cut_short_poisons_the_connection_for_good(bridge: Bridge):
    count = len(bridge.heard())
    with Client(bridge) as client, Client(bridge) as other:
        client.socket.send('{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":0.1,"y":0.0,"z":0.0},"angu')
        for _ in range(20):
            client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
        client.send(op="call_service", service="/rosapi/get_time", id="t")
        assert client.nothing_comes()
        assert heard_since(bridge, count) == []
        other.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.05}})  # others are not touched
        assert until(lambda: heard_since(bridge, count) == [(0.05, 0.0, 0.0)])


def test_two_objects_in_one_frame_and_one_object_in_two(bridge: Bridge, client: Client):
    count = len(bridge.heard())
    one = '{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":0.01}}}'
    two = '{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":0.02}}}'
    client.socket.send(one + two)
    assert until(lambda: heard_since(bridge, count) == [(0.01, 0.0, 0.0), (0.02, 0.0, 0.0)])
    client.socket.send(one[:30])  # no complete inner object yet: not poisoned
    client.socket.send(one[30:])
    assert until(lambda: heard_since(bridge, count)[2:] == [(0.01, 0.0, 0.0)])


def test_fragmented_frames_binary_frames_and_pings(bridge: Bridge, client: Client):
    count = len(bridge.heard())
    text = json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.04}}})
    frame = websocket.ABNF
    client.socket.send_frame(frame.create_frame(text[:20], frame.OPCODE_TEXT, 0))
    client.socket.ping(b"between")  # control frames may come between fragments
    client.socket.send_frame(frame.create_frame(text[20:], frame.OPCODE_CONT, 1))
    opcode, data = client.socket.recv_data(control_frame=True)
    assert (opcode, data) == (frame.OPCODE_PONG, b"between")
    assert until(lambda: heard_since(bridge, count) == [(0.04, 0.0, 0.0)])
    client.socket.send_binary(text.encode())
    assert client.call("/rosapi/get_time")["result"] is True
    assert heard_since(bridge, count) == [(0.04, 0.0, 0.0)]


def test_rosbridge_fragments_from_the_client(bridge: Bridge, client: Client):
    count = len(bridge.heard())
    text = json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.06}}})
    client.send(op="fragment", id="f", data=text[10:], num=1, total=2)
    client.send(op="fragment", id="f", data=text[:10], num=0, total=2)
    assert until(lambda: heard_since(bridge, count) == [(0.06, 0.0, 0.0)])


def test_throttle_and_queue(client: Client):
    client.send(op="subscribe", topic=POSE_TOPIC, throttle_rate=100, queue_length=1)
    stamps: list[float] = []
    for _ in range(6):
        stamp = client.read_topic(POSE_TOPIC)["header"]["stamp"]
        stamps.append(stamp["secs"] + stamp["nsecs"] * 1e-9)
    spacing = [b - a for a, b in itertools.pairwise(stamps)]
    assert min(spacing) > 0.08
    client.send(op="subscribe", id="faster", topic=POSE_TOPIC, throttle_rate=0)  # merged: the lowest wins
    burst = []
    assert until(
        lambda: bool(burst.append(client.read_topic(POSE_TOPIC)["header"]["seq"])) or len(burst) > 20, every_s=0
    )
    assert burst[-1] - burst[-10] == 9


def test_latched_client_count_and_latched_topics(bridge: Bridge, client: Client):
    client.send(op="subscribe", topic="/rosbridge_websocket/client_count")
    before = client.read()["msg"]["data"]
    with Client(bridge):
        assert client.read()["msg"]["data"] == before + 1
    assert client.read()["msg"]["data"] == before
    client.send(op="advertise", topic="/note", type="std_msgs/String", latch=True)
    client.send(op="publish", topic="/note", msg={"data": "kept"})
    client.call("/rosapi/get_time")
    with Client(bridge) as late:
        late.send(op="subscribe", topic="/note", type="std_msgs/String")
        assert late.read_topic("/note") == {"data": "kept"}


def test_clean_close_and_what_is_no_websocket(bridge: Bridge):
    before = bridge.report()["clients"]
    with Client(bridge) as client:
        client.socket.send_close(1000, b"bye")
        opcode, _ = client.socket.recv_data(control_frame=True)
        assert opcode == websocket.ABNF.OPCODE_CLOSE
    raw = socket.create_connection(("127.0.0.1", int(bridge.url.rpartition(":")[2])), timeout=2)
    raw.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
    assert raw.recv(1000).startswith(b"HTTP/1.1 4")
    raw.close()
    assert until(lambda: bridge.report()["clients"] == before)


def test_the_base_stops_when_its_client_vanishes(bridge: Bridge):
    with Client(bridge) as client:
        client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
        assert until(lambda: bridge.report()["velocity"][0] == pytest.approx(0.1))
        count = len(bridge.heard())
        client.socket.shutdown()
    assert until(lambda: bridge.report()["velocity"] == [0.0, 0.0, 0.0])
    assert heard_since(bridge, count) == []  # the bridge itself says nothing, not even zero


def test_status_comes_every_second_and_at_once_on_a_stop(bridge: Bridge, client: Client):
    client.send(op="subscribe", topic="/mcu/status", type="ridgeback_msgs/Status")
    assert client.read_topic("/mcu/status")["drivers_active"] is True
    bridge.do("press_stop")
    pressed = client.read_topic("/mcu/status")
    assert (pressed["stop_engaged"], pressed["drivers_active"]) == (True, False)
    bridge.do("release_stop")
    assert client.read_topic("/mcu/status")["drivers_active"] is True


def test_ros_2_spelling():
    topics = TopicsConfig(ros_version=2, command_type="geometry_msgs/msg/TwistStamped")
    with running_bridge(topics=topics) as bridge, Client(bridge) as client:
        assert client.call("/rosapi/topic_type", {"topic": "/cmd_vel"})["values"] == {
            "type": "geometry_msgs/msg/TwistStamped"
        }
        client.send(op="subscribe", topic=POSE_TOPIC, type="geometry_msgs/TransformStamped")  # resolved
        header = client.read_topic(POSE_TOPIC)["header"]
        assert set(header) == {"stamp", "frame_id"}
        assert set(header["stamp"]) == {"sec", "nanosec"}
        client.send(op="publish", topic="/cmd_vel", msg={"header": {}, "twist": {"linear": {"x": 0.1}}})
        assert until(lambda: heard_since(bridge, 0) == [(0.1, 0.0, 0.0)])
