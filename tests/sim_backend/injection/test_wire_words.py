"""The words for what an emulated device does wrong from the start."""

import pytest

from robot_io.errors import ConfigError
from robot_io.rig.fault_words import KINDS
from sim_backend.injection.wire_words import ON_THE_WIRE, WIRE_KINDS, parse_wire_fault


@pytest.mark.parametrize(
    ("text", "device", "kind", "value"),
    [
        ("ft.latency", "ft", "latency", (16.0,)),
        ("ft.latency=1", "ft", "latency", (1.0,)),
        ("ft.wrong=1,2,3 at 0 s", "ft", "wrong", (1.0, 2.0, 3.0)),
        ("base.pose.off", "base.pose", "off", ()),
        ("base.second-publisher at 0 s", "base", "second-publisher", ()),
        (" arm.protective-stop ", "arm", "protective-stop", ()),
    ],
)
def test_words_are_understood(text, device, kind, value):
    fault = parse_wire_fault(text)
    assert (fault.device, fault.kind, fault.value) == (device, kind, value)


@pytest.mark.parametrize(
    "text",
    ["", "ft", "ft.latency=many", "ft.latency=nan", "ft.echo=1", "ft.off at 3 s", "ft.off at 0 s for 1 s", "base.off",
     "base.pose.mirrored", "arm.slow", "gripper.off", "ft.wrong=1,2,3,4,5,6,7"],
)  # fmt: skip
def test_what_cannot_be_is_refused(text):
    with pytest.raises(ConfigError):
        parse_wire_fault(text)


def test_a_near_word_is_suggested():
    with pytest.raises(ConfigError) as caught:
        parse_wire_fault("base.second-publsher")
    assert "`base.second-publisher`" in caught.value.do


def test_no_word_means_two_things():
    assert all(set(ON_THE_WIRE[device]) <= set(KINDS[device]) for device in ON_THE_WIRE)
    assert all(not set(WIRE_KINDS[device]) & set(ON_THE_WIRE.get(device, ())) for device in WIRE_KINDS)
