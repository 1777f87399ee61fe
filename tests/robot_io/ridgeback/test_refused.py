"""A topic without a usable message: nothing came, or what came could not be read."""

from robot_io.errors import DeviceNotReady, DeviceProtocolError
from robot_io.ridgeback.refused import RefusedMessages

ODOMETRY = rb'{"op": "publish", "topic": "\/odometry\/filtered", "msg": {"x": NaN}}'


def test_a_topic_whose_messages_were_refused_is_told_so():
    refused = RefusedMessages()
    refused.note(b'{"topic": "/other"}', ValueError("no"))
    refused.note(ODOMETRY, ValueError("JSON is malformed"))
    error = refused.explain(["/base_pose", "/odometry/filtered"], "ws://there", 2.0)
    assert isinstance(error, DeviceProtocolError)
    assert error.what == "messages on /odometry/filtered arrived but could not be read (JSON is malformed)"
    assert refused.reason_of("/odometry/filtered") == "JSON is malformed"
    assert refused.reason_of("/odometry") == ""


def test_a_topic_that_stayed_silent_is_told_so():
    refused = RefusedMessages()
    refused.note(ODOMETRY, ValueError("JSON is malformed"))
    error = refused.explain(["/odometry"], "ws://there", 2.0)
    assert isinstance(error, DeviceNotReady)
    assert error.what == "no message on /odometry within 2 s"


def test_a_flood_of_refused_messages_is_not_kept():
    refused = RefusedMessages()
    for _ in range(1000):
        refused.note(b"x" * 100_000, ValueError("y" * 100_000))
    refused.note(ODOMETRY, ValueError("JSON is malformed"))
    assert "no message" in refused.explain(["/odometry/filtered"], "", 2.0).what
