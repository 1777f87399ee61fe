"""The words for a fault to inject: what is read from them, and one sentence for what cannot be read."""

import math

import pytest

from robot_io.errors import ConfigError
from robot_io.rig.fault_words import KINDS, parse_fault


def test_device_kind_value_and_times_are_read():
    word = parse_fault("ft.frozen at 3 s for 1 s")
    assert (word.device, word.kind, word.value, word.at_s, word.for_s) == ("ft", "frozen", (), 3.0, 1.0)
    word = parse_fault("  base.pose.wrong=0.5,-1,2e-1   at 0.25 s ")
    assert (word.device, word.kind, word.value, word.at_s) == ("base.pose", "wrong", (0.5, -1.0, 0.2), 0.25)
    assert word.for_s == math.inf
    assert word.text == "base.pose.wrong=0.5,-1,2e-1 at 0.25 s"


def test_a_fault_is_present_from_its_time_on_for_its_time():
    word = parse_fault("arm.off at 3 s for 1 s")
    assert [word.active(t) for t in (-1.0, 0.0, 2.999, 3.0, 3.999, 4.0)] == [False, False, False, True, True, False]
    assert parse_fault("arm.off at 3 s").active(1e6)


@pytest.mark.parametrize("device", ["ft", "arm", "base.pose", "base.odometry", "base.command", "base.status"])
def test_every_device_has_the_common_kinds(device):
    for kind in ("off", "frozen", "garbage", "wrong", "scaled", "slow", "delayed", "intermittent"):
        assert parse_fault(f"{device}.{kind} at 1 s").kind == kind


def test_every_kind_can_be_written_without_a_value():
    for device, kinds in KINDS.items():
        for kind in kinds:
            assert parse_fault(f"{device}.{kind} at 1 s").value == kinds[kind].default


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("ft.frozen", "cannot read"),
        ("ft.frozen at 3", "cannot read"),
        ("frozen at 3 s", "cannot read"),
        ("ft.frozen at 3 s for", "cannot read"),
        ("", "cannot read"),
        ("lidar.off at 3 s", "no device `lidar`"),
        ("base.off at 3 s", "no device `base`"),
        ("ft.frozn at 3 s", "Did you mean `frozen`"),
        ("arm.crc at 3 s", "`arm` has no fault `crc`"),
        ("ft.frozen=1 at 3 s", "takes no value"),
        ("ft.slow=0 at 3 s", "above 0"),
        ("ft.slow=5,6 at 3 s", "one number"),
        ("ft.wrong=1,2,3,4,5,6,7 at 3 s", "up to 6 numbers"),
        ("ft.wrong=a at 3 s", "not a number"),
        ("ft.wrong=nan at 3 s", "not a number"),
        ("ft.off at -1 s", "0 s or later"),
        ("ft.off at inf s", "not a number"),
        ("ft.off at 1 s for 0 s", "longer than 0 s"),
    ],
)
def test_what_cannot_be_read_is_named(words, said):
    with pytest.raises(ConfigError) as raised:
        parse_fault(words)
    assert said in str(raised.value)
