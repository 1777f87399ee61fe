"""The emulated `rosapi` as a client nobody here wrote asks it, in ROS 1 and ROS 2.

Service names, types and fields are those of the .srv files of rosapi 0.11.17 and of rosapi_msgs.
"""

import pytest

from robot_io.rig.topics import TopicsConfig
from tests.peers.test_rosbridge_peers import POSE_TOPIC, Client
from tests.wire.bridge_process import running_bridge

ROS_2 = TopicsConfig(ros_version=2, command_type="geometry_msgs/msg/TwistStamped")


@pytest.fixture(scope="module")
def bridge():
    with running_bridge() as running:
        yield running


@pytest.fixture(scope="module")
def bridge_2():
    with running_bridge(topics=ROS_2) as running:
        yield running


def ask(bridge, service, /, **arguments):
    with Client(bridge) as client:
        answer = client.call(f"/rosapi/{service}", arguments)
    assert answer["result"] is True, answer
    return answer["values"]


def test_message_details_describe_a_type_and_all_types_in_it(bridge):
    typedefs = ask(bridge, "message_details", type="geometry_msgs/TwistStamped")["typedefs"]
    kinds = ["geometry_msgs/TwistStamped", "std_msgs/Header", "time", "geometry_msgs/Twist", "geometry_msgs/Vector3"]
    assert [entry["type"] for entry in typedefs] == kinds
    assert typedefs[1] == {
        "type": "std_msgs/Header",
        "fieldnames": ["seq", "stamp", "frame_id"],
        "fieldtypes": ["uint32", "time", "string"],
        "fieldarraylen": [-1, -1, -1],
        "examples": ["0", "{}", ""],
        "constnames": [],
        "constvalues": [],
    }
    assert (typedefs[2]["fieldnames"], typedefs[2]["fieldtypes"]) == (["secs", "nsecs"], ["int32", "int32"])
    assert typedefs[4]["examples"] == ["0.0", "0.0", "0.0"]


def test_message_details_tell_the_lengths_of_arrays(bridge):
    state = ask(bridge, "message_details", type="sensor_msgs/JointState")["typedefs"][0]
    assert dict(zip(state["fieldnames"], state["fieldarraylen"], strict=True))["position"] == 0
    pose = ask(bridge, "message_details", type="geometry_msgs/PoseWithCovariance")["typedefs"][0]
    assert pose["fieldtypes"] == ["geometry_msgs/Pose", "float64"]
    assert pose["fieldarraylen"] == [-1, 36]
    assert pose["examples"] == ["{}", "[]"]


def test_an_unknown_type_fails_in_ros_1_and_is_empty_in_ros_2(bridge, bridge_2):
    for unknown in ("no_msgs/Such", "geometry_msgs/msg/Twist"):
        with Client(bridge) as client:
            answer = client.call("/rosapi/message_details", {"type": unknown})
        assert answer["result"] is False
        assert unknown in answer["values"]
    assert ask(bridge_2, "message_details", type="no_msgs/msg/Such") == {"typedefs": []}


def test_node_details_tell_what_a_node_does(bridge):
    capture = ask(bridge, "node_details", node="/vicon_bridge")
    assert POSE_TOPIC in capture["publishing"]
    assert capture["services"] == []
    mux = ask(bridge, "node_details", node="/twist_mux")
    assert "/cmd_vel" in mux["subscribing"]
    api = ask(bridge, "node_details", node="/rosapi")
    assert {"/rosapi/node_details", "/rosapi/topics"} <= set(api["services"])
    nobody = {"subscribing": [], "publishing": [], "services": []}
    assert ask(bridge, "node_details", node="/nobody") == nobody


def test_services_know_their_types_and_what_they_take(bridge):
    assert ask(bridge, "service_type", service="/rosapi/topic_type") == {"type": "rosapi/TopicType"}
    assert ask(bridge, "service_type", service="/rosapi/action_servers") == {"type": "rosapi/GetActionServers"}
    assert ask(bridge, "services_for_type", type="rosapi/TopicType") == {"services": ["/rosapi/topic_type"]}
    assert ask(bridge, "service_node", service="/rosapi/topic_type") == {"node": "/rosapi"}
    assert ask(bridge, "service_providers", service="rosapi/TopicType") == {"providers": ["/rosapi"]}
    taken = ask(bridge, "service_request_details", type="rosapi/TopicType")["typedefs"]
    assert [(entry["type"], entry["fieldnames"]) for entry in taken] == [("rosapi/TopicTypeRequest", ["topic"])]
    given = ask(bridge, "service_response_details", type="rosapi/MessageDetails")["typedefs"]
    assert [entry["type"] for entry in given] == ["rosapi/MessageDetailsResponse", "rosapi/TypeDef"]
    assert given[1]["fieldnames"][:4] == ["type", "fieldnames", "fieldtypes", "fieldarraylen"]


def test_the_parameter_server_of_ros_1(bridge):
    assert ask(bridge, "get_param", name="/gain", default="7") == {"value": "7"}
    assert ask(bridge, "get_param", name="/gain") == {"value": "null"}
    assert ask(bridge, "set_param", name="/gain", value="[1, 2]") == {}
    assert ask(bridge, "get_param", name="/gain", default="7") == {"value": "[1, 2]"}
    assert ask(bridge, "has_param", name="/gain") == {"exists": True}
    assert ask(bridge, "search_param", name="gain") == {"global_name": "/gain"}
    assert "/gain" in ask(bridge, "get_param_names")["names"]
    assert ask(bridge, "delete_param", name="/gain") == {}
    assert ask(bridge, "has_param", name="/gain") == {"exists": False}


def test_names_and_types_of_ros_2(bridge_2):
    assert ask(bridge_2, "topic_type", topic="/cmd_vel") == {"type": "geometry_msgs/msg/TwistStamped"}
    assert ask(bridge_2, "service_type", service="/rosapi/topic_type") == {"type": "rosapi_msgs/srv/TopicType"}
    assert ask(bridge_2, "get_ros_version")["version"] == 2
    for spelt in ("std_msgs/msg/Header", "std_msgs/Header"):
        header, stamp = ask(bridge_2, "message_details", type=spelt)["typedefs"]
        assert header["type"] == "std_msgs/Header"
        assert header["fieldtypes"] == ["builtin_interfaces/Time", "string"]
        assert (stamp["type"], stamp["fieldnames"]) == ("builtin_interfaces/Time", ["sec", "nanosec"])
        assert stamp["fieldtypes"] == ["int32", "uint32"]
    twist = ask(bridge_2, "message_details", type="geometry_msgs/msg/Vector3")["typedefs"][0]
    assert twist["fieldtypes"] == ["double"] * 3
    assert "geometry_msgs/msg/Twist" in ask(bridge_2, "interfaces")["interfaces"]
    request = ask(bridge_2, "service_request_details", type="rosapi_msgs/srv/TopicType")["typedefs"][0]
    assert (request["type"], request["fieldnames"]) == ("rosapi_msgs/TopicType_Request", ["topic"])
    refused = ask(bridge_2, "set_param", name="/twist_mux:gain", value="1")
    assert refused["successful"] is False
    assert refused["reason"]


@pytest.mark.parametrize("type_name", ["std_msgs/msg/String", "std_msgs/String"])
def test_ros_2_takes_either_spelling_on_a_topic(bridge_2, type_name):
    with Client(bridge_2) as client:
        client.send(op="subscribe", topic="/said", type=type_name)
        client.send(op="advertise", topic="/said", type=type_name)
        client.send(op="publish", topic="/said", msg={"data": "heard"})
        assert client.read_topic("/said") == {"data": "heard"}
        kept = client.call("/rosapi/topic_type", {"topic": "/said"})["values"]
    assert kept == {"type": "std_msgs/msg/String"}


def test_what_belongs_to_the_other_ros_is_not_there(bridge, bridge_2):
    for running, service in ((bridge, "/rosapi/get_ros_version"), (bridge_2, "/rosapi/search_param")):
        with Client(running) as client:
            answer = client.call(service)
        assert (answer["result"], answer["values"]) == (False, f"Service {service} does not exist")


def test_an_action_is_refused_by_ros_2_and_unknown_to_ros_1(bridge, bridge_2):
    goal = {"op": "send_action_goal", "action": "/dock", "action_type": "nav_msgs/action/Dock", "id": "g1", "args": {}}
    with Client(bridge_2) as client:
        client.send(**goal)
        answer = client.read()
    assert {key: answer[key] for key in ("op", "action", "id", "result", "status")} == {
        "op": "action_result",
        "action": "/dock",
        "id": "g1",
        "result": False,
        "status": 0,
    }
    assert "/dock" in answer["values"]
    with Client(bridge) as client:
        client.send(**goal)
        assert client.call("/rosapi/get_time")["op"] == "service_response"  # nothing else has come before it
