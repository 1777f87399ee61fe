"""Types made from the schema text in a log: every topic of ours, foreign texts, hostile texts."""

from __future__ import annotations

import re

import pytest
from rosbags.typesys import Stores, get_typestore

from robot_io.cdr.schema import type_from_schema
from robot_io.errors import LogDamaged
from robot_io.log.channels import BY_TOPIC
from robot_io.log.ros_messages import DIAGNOSTIC_ARRAY, DiagnosticArray, DiagnosticStatus, Header, KeyValue, ros_time


@pytest.mark.parametrize("topic", sorted(BY_TOPIC))
def test_the_type_from_the_text_has_the_same_text(topic):
    cdr_type = BY_TOPIC[topic].cdr_type
    without_constants = re.sub(r"^\w+ [A-Z]\w*=.*\n", "", cdr_type.schema_text, flags=re.MULTILINE)
    assert type_from_schema(cdr_type.name, cdr_type.schema_text).schema_text == without_constants


def test_it_reads_what_the_original_type_wrote():
    value = DiagnosticArray(
        Header(ros_time(5), "world"), (DiagnosticStatus(1, "a", "b", "c", (KeyValue("k", "v"),) * 2),)
    )
    read = type_from_schema(DIAGNOSTIC_ARRAY.name, DIAGNOSTIC_ARRAY.schema_text).decode(DIAGNOSTIC_ARRAY.encode(value))
    assert read.status[0].values[1].value == "v"
    assert read.header.stamp.nanosec == 5


def test_text_as_ros_writes_it_with_comments_constants_bounds_and_bare_names():
    text = """
# a comment
byte OK=0
string<=5 NAME="x"
Point32 where  # bare name: same package
geometry_msgs/msg/Point32[<=3] more
string<=10 label
float64[2] pair
int32 number 7
================================================================================
MSG: geometry_msgs/Point32
float32 x
float32 y
"""
    cdr_type = type_from_schema("geometry_msgs/msg/Thing", text)
    expected = [
        "geometry_msgs/Point32 where",
        "geometry_msgs/Point32[] more",
        "string label",
        "float64[2] pair",
        "int32 number",
    ]
    assert cdr_type.schema_text.split("=")[0].split("\n")[:-1] == expected


def test_an_empty_message_has_its_one_byte():
    assert type_from_schema("std_msgs/msg/Empty", "").decode(b"\x00\x01\x00\x00\x00")


def test_definitions_as_rosbags_writes_them():
    store = get_typestore(Stores.ROS2_HUMBLE)
    text, _ = store.generate_msgdef("nav_msgs/msg/Odometry", ros_version=2)
    ours = BY_TOPIC["/base/odom"].cdr_type
    assert type_from_schema("nav_msgs/msg/Odometry", text).schema_text == ours.schema_text


BOMB = "".join(f"{'=' * 80}\nMSG: p/T{n}\n" + f"p/T{n + 1} a\np/T{n + 1} b\n" for n in range(1, 18))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p/msg/T", "p/T again"),
        ("p/msg/T", "p/Missing x"),
        ("p/msg/T", "wstring x"),
        ("p/msg/T", "float64 x\nfloat64 x"),
        ("p/msg/T", "no field at all!"),
        ("p/msg/T0", "p/T1 a\np/T1 b\n" + BOMB + f"{'=' * 80}\nMSG: p/T18\nbool x\n"),
        ("T", "bool x"),
        ("p/msg/T", "bool x\n=====\nrubbish"),
        ("p/msg/T", "bool[0] x"),
    ],
)
def test_texts_that_cannot_be_used_are_one_error(name, text):
    with pytest.raises(LogDamaged, match="schema"):
        type_from_schema(name, text)


def test_a_huge_fixed_array_costs_nothing_until_the_payload_is_too_short():
    cdr_type = type_from_schema("p/msg/T", "float64[4000000000] x\nstring[4000000000] y")
    with pytest.raises(LogDamaged):
        cdr_type.decode(b"\x00\x01\x00\x00" + bytes(100))
