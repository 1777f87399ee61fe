"""Hard ceilings: a rig may go below each and above none; and what the limits are made of."""

import math

import pytest
from msgspec.structs import replace

from robot_io.errors import ConfigError
from robot_io.rig.files import shipped_rigs
from safety.limits import CEILINGS, MAX_SPEED_M_PER_S, check, speed_limit_m_per_s
from safety.settings import SafetySettings
from tools.rig import resolve_rig

RIG = resolve_rig("sim")


def with_value(key, value):
    table, name = key.split(".")
    return replace(RIG, **{table: replace(getattr(RIG, table), **{name: value})})


WRITTEN_DOWN = {
    "limits.max_force_N": 150.0,
    "limits.slow_force_N": 100.0,
    "limits.max_torque_Nm": 20.0,
    "limits.max_acceleration_m_per_s2": 2.5,
    "limits.max_yaw_acceleration_rad_per_s2": 1.0,
    "limits.max_heading_error_deg": 20.0,
    "limits.drift_hold_rad": 0.01,
    "limits.drift_stop_rad": 0.02,
}


def test_the_ceilings_are_those():
    assert {c.key: c.value for c in CEILINGS} == WRITTEN_DOWN
    assert all(c.reason for c in CEILINGS)
    assert MAX_SPEED_M_PER_S == 0.75


@pytest.mark.parametrize("key", WRITTEN_DOWN)
def test_each_ceiling(key):
    value = WRITTEN_DOWN[key]
    rig = with_value(key, value)
    if key == "limits.drift_hold_rad":  # must also stay below drift_stop_rad
        rig = replace(rig, limits=replace(rig.limits, drift_stop_rad=0.02))
    check(rig)
    for bad in (math.nextafter(value, math.inf), value * 1.01, math.inf, math.nan):
        with pytest.raises(ConfigError) as error:
            check(with_value(key, bad))
        assert key in str(error.value)


def changed(**values):
    """Return the rig with some of `limits` and `control` changed."""
    limits = {key: value for key, value in values.items() if hasattr(RIG.limits, key)}
    control = {key: value for key, value in values.items() if hasattr(RIG.control, key)}
    return replace(RIG, limits=replace(RIG.limits, **limits), control=replace(RIG.control, **control))


@pytest.mark.parametrize(
    ("upper", "low"),
    [
        ({"max_force_N": 80.0}, "slow_force_N"),
        ({"drift_stop_rad": 0.008}, "drift_hold_rad"),
        ({"slow_force_N": 30.0}, "force_min_N"),
    ],
)
def test_a_lower_threshold_is_below_its_upper_one(upper, low):
    (bound,) = upper.values()
    check(changed(**upper, **{low: bound * 0.99}))
    for too_high in (bound, bound * 1.01):
        with pytest.raises(ConfigError, match=low):
            check(changed(**upper, **{low: too_high}))


def test_every_problem_is_told_at_once():
    rig = replace(RIG, limits=replace(RIG.limits, max_force_N=400.0, max_torque_Nm=29.0))
    with pytest.raises(ConfigError) as error:
        check(rig)
    assert "max_force_N" in str(error.value)
    assert "max_torque_Nm" in str(error.value)


@pytest.mark.parametrize("name", shipped_rigs())
def test_every_shipped_rig_is_inside(name):
    check(resolve_rig(name))


@pytest.mark.parametrize(("speed", "factor", "limit"), [(0.1, 1.5, 0.15), (0.5, 1.5, 0.75), (0.5, 3.0, 0.75)])
def test_the_envelope_is_a_factor_above_the_push_and_never_above_the_ceiling(speed, factor, limit):
    rig = with_value("control.push_speed_m_per_s", speed)
    rig = replace(rig, limits=replace(rig.limits, envelope_factor=factor))
    assert speed_limit_m_per_s(rig) == pytest.approx(limit)


def test_the_settings_are_in_si_units():
    settings = SafetySettings.of(RIG)
    assert settings.period_ns == 10_000_000
    assert settings.max_heading_error == pytest.approx(math.radians(5.0))
    assert settings.pose_period_ns == 10_000_000
    limits = settings.envelope
    assert (limits.speed, limits.turn_rate, limits.period_ns) == (pytest.approx(0.15), 0.25, 10_000_000)


def test_an_approach_that_the_envelope_would_clamp_is_refused():
    rig = with_value("control.push_speed_m_per_s", 0.05)
    check(replace(rig, control=replace(rig.control, approach_speed_m_per_s=0.075)))
    with pytest.raises(ConfigError, match="approach_speed_m_per_s"):
        check(replace(rig, control=replace(rig.control, approach_speed_m_per_s=0.08)))
