"""The services of `rosapi` in ROS 1 and ROS 2: name, fields of the request, fields of the answer.

Source: the .srv files of rosapi (ROS 1, 0.11.17) and rosapi_msgs (ROS 2). Left out: the services about action types.
"""

from __future__ import annotations

from sim_backend.ridgeback.ros_types import Fields, fields_in

_TYPEDEFS = "TypeDef[] typedefs"
_IN_BOTH = {
    "topics": ("", "string[] topics, string[] types"),
    "topics_for_type": ("string type", "string[] topics"),
    "topics_and_raw_types": ("", "string[] topics, string[] types, string[] typedefs_full_text"),
    "topic_type": ("string topic", "string type"),
    "publishers": ("string topic", "string[] publishers"),
    "subscribers": ("string topic", "string[] subscribers"),
    "nodes": ("", "string[] nodes"),
    "node_details": ("string node", "string[] subscribing, string[] publishing, string[] services"),
    "services": ("", "string[] services"),
    "services_for_type": ("string type", "string[] services"),
    "service_type": ("string service", "string type"),
    "service_node": ("string service", "string node"),
    "service_providers": ("string service", "string[] providers"),
    "message_details": ("string type", _TYPEDEFS),
    "service_request_details": ("string type", _TYPEDEFS),
    "service_response_details": ("string type", _TYPEDEFS),
    "action_servers": ("", "string[] action_servers"),
    "has_param": ("string name", "bool exists"),
    "get_param_names": ("", "string[] names"),
    "get_time": ("", "time time"),
}
_IN_ROS_1 = {
    "service_host": ("string service", "string host"),
    "get_param": ("string name, string default", "string value"),
    "set_param": ("string name, string value", ""),
    "delete_param": ("string name", ""),
    "search_param": ("string name", "string global_name"),
}
_IN_ROS_2 = {
    "get_param": ("string name", "string value, bool successful, string reason"),
    "set_param": ("string name, string value", "bool successful, string reason"),
    "delete_param": ("string name", "bool successful, string reason"),
    "get_ros_version": ("", "uint8 version, string distro"),
    "interfaces": ("", "string[] interfaces"),
}
_TYPE_NAMES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
TYPEDEF_FIELDS = fields_in(
    "string type, string[] fieldnames, string[] fieldtypes, int32[] fieldarraylen, string[] examples, "
    "string[] constnames, string[] constvalues"
)


def package(ros_version: int) -> str:
    """Return the package of rosapi's own types."""
    return "rosapi_msgs" if ros_version == 2 else "rosapi"


def services(ros_version: int) -> dict[str, tuple[Fields, Fields]]:
    """Return request and answer of each service, by its full name."""
    known = {**_IN_BOTH, **(_IN_ROS_2 if ros_version == 2 else _IN_ROS_1)}
    own = f"{package(ros_version)}/TypeDef"
    return {
        f"/rosapi/{name}": (fields_in(request), fields_in(answer.replace("TypeDef", own)))
        for name, (request, answer) in known.items()
    }


def service_type(name: str, ros_version: int) -> str:
    """Return the type of the service of that full name, as this ROS version spells it."""
    last = name.rpartition("/")[2]
    camel = _TYPE_NAMES.get(last) or "".join(map(str.capitalize, last.split("_")))
    return f"{package(ros_version)}/{'srv/' if ros_version == 2 else ''}{camel}"
