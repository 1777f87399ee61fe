"""What an emulated e-Series controller makes of its sensor, worked out by hand."""

import math

import pytest

from sim_backend.ft300.standalone import ConstantWrench
from sim_backend.ur10.force_sensor import ForceSensor

OUTSTRETCHED = (0.0,) * 6
"""From UR's drawing the flange's x points to +x of the base, its y to +z, its z to -y."""
NO_PAYLOAD = (0.0, (0.0, 0.0, 0.0))


def test_the_force_on_the_tool_is_in_the_axes_of_the_base() -> None:
    sensor = ForceSensor(ConstantWrench((1.0, 2.0, 3.0, 4.0, 5.0, 6.0)))
    assert sensor.compensated(0, OUTSTRETCHED, *NO_PAYLOAD) == pytest.approx((1.0, -3.0, 2.0, 4.0, -6.0, 5.0))


def test_pushing_ahead_in_the_held_pose() -> None:
    """Forward is -y of the arm's base, so 15 N backward on the tool are +15 N in y (docs/frames-and-signs.md)."""
    sensor = ForceSensor(ConstantWrench((0.0, 0.0, -15.0, 0.0, 0.0, 0.0)))
    held = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)
    assert sensor.compensated(0, held, *NO_PAYLOAD)[:3] == pytest.approx((0.0, 15.0, 0.0), abs=1e-3)


def test_the_payloads_weight_is_taken_off() -> None:
    """1 kg, 10 cm along the flange's z, so at (0, -0.1, 0) m of the base: -9.82 N in z, and 0.982 N*m about x."""
    weight = 9.82
    felt = ForceSensor(ConstantWrench((0.0, -weight, 0.0, 0.1 * weight, 0.0, 0.0)))
    assert felt.compensated(0, OUTSTRETCHED, 1.0, (0.0, 0.0, 0.1)) == pytest.approx((0.0,) * 6)


def test_without_a_reading_the_payload_pulls_up() -> None:
    """As seen at a real controller that is fed nothing: 1 kg gives +9.82 N in z."""
    sensor = ForceSensor(ConstantWrench((0.0,) * 6))
    assert sensor.compensated(0, OUTSTRETCHED, 1.0, (0.0, 0.0, 0.0))[2] == pytest.approx(9.82)


def test_zeroing_leaves_the_raw_reading() -> None:
    reading = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    sensor = ForceSensor(ConstantWrench(reading))
    sensor.zero(0, OUTSTRETCHED, *NO_PAYLOAD)
    assert sensor.compensated(2, OUTSTRETCHED, *NO_PAYLOAD) == pytest.approx((0.0,) * 6)
    assert sensor.raw(2) == reading


def test_faults() -> None:
    sensor = ForceSensor(ConstantWrench((1.0,) * 6))
    sensor.jump = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert sensor.raw(0) == (6.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    sensor.broken = True
    assert all(map(math.isnan, sensor.raw(0)))
    assert not ForceSensor(None).fitted
