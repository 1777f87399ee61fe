"""From packets to the force on the slider: median, sign, filter, what counts as valid and as contact.

The sensor is mounted with its axes along the BODY frame and the base looks along x: the reaction on the tool, with the
opposite sign, is the force on the slider. No filter, no bias.
"""

from __future__ import annotations

import math

import pytest
from msgspec.structs import replace

from control.sensing import in_contact, sense
from control.settings import Settings
from robot_io.tick import ContactState, ControlState, FtReading, Phase
from tools.rig import resolve_rig

MS = 1_000_000
NOW = 5_000 * MS
SETTINGS = replace(
    Settings.of(resolve_rig("sim", ("control.force_filter_tau_s=0", "control.force_min_N=5"))),
    base_from_sensor=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
)


def felt(state, *newtons, settings=SETTINGS, at=NOW):
    """Return the state after one tick with packets of these forces of the slider on the tool along x, 10 ms apart."""
    packets = tuple(
        FtReading(at - 10 * MS * (len(newtons) - 1 - n), n, (-newton, 0.0, 0.0), (0.0,) * 3)
        for n, newton in enumerate(newtons)
    )
    return sense(settings, state, packets, 0.0, at)


def in_phase(phase, **more):
    return ControlState(phase=int(phase), tared=True, **more)


def x_of(state):
    return state.force_world[0]


def test_the_first_two_packets_count_as_they_are_and_then_the_middle_one_of_three():
    state = felt(in_phase(Phase.PUSH), 7.0)
    assert x_of(state) == 7.0
    state = felt(state, 90.0)
    assert x_of(state) == 7.0, "of two, the one that both agree with"
    assert x_of(felt(state, 8.0)) == 8.0, "of 7, 90, 8"
    assert x_of(felt(felt(state, 8.0), 6.0)) == 8.0, "of 90, 8, 6"
    assert felt(state, *[8.0] * 9).contact.packets == 2


def test_after_a_silence_the_median_begins_anew():
    state = replace(felt(in_phase(Phase.PUSH), 7.0, 7.0, 7.0), force_valid=False)
    assert x_of(felt(state, 90.0)) == 90.0


def test_only_the_first_force_after_a_silence_is_taken_unfiltered():
    slow = replace(SETTINGS, control=replace(SETTINGS.control, force_filter_tau_s=0.1))
    state = felt(in_phase(Phase.PUSH, last_reading_ns=NOW - 20 * MS), 10.0, settings=slow)
    assert x_of(state) == 10.0
    settled = felt(state, 0.0, 0.0, 0.0, settings=slow, at=NOW + 30 * MS)  # the first of them is 10 N by the median
    assert x_of(settled) == pytest.approx(10.0 * math.exp(-0.2), rel=0.05)
    # 6 N and, by the median, 6 and 10 N: the third moves it by a tenth of the difference.
    begun = felt(in_phase(Phase.PUSH, last_reading_ns=NOW), 6.0, 10.0, 10.0, settings=slow, at=NOW + 30 * MS)
    assert x_of(begun) == pytest.approx(6.38, abs=0.01)
    again = felt(replace(settled, force_valid=False), 6.0, 6.0, settings=slow, at=NOW + 50 * MS)
    assert x_of(again) == 6.0


def test_without_packets_a_force_stays_valid_for_a_tenth_of_a_second_and_never_becomes_so():
    state = felt(in_phase(Phase.PUSH), 7.0)
    assert state.force_valid
    assert sense(SETTINGS, state, (), 0.0, NOW + 100 * MS).force_valid
    assert not sense(SETTINGS, state, (), 0.0, NOW + 101 * MS).force_valid
    bad = felt(state, math.nan, math.nan)
    assert not bad.force_valid
    assert not sense(SETTINGS, bad, (), 0.0, NOW + 10 * MS).force_valid


@pytest.mark.parametrize(("newton", "run"), [(4.99, 0), (5.0, 3), (-5.0, 3)])
def test_readings_of_force_min_in_a_row_are_counted(newton, run):
    assert felt(in_phase(Phase.PUSH), *[newton] * 3).contact_run == run


def test_one_reading_below_begins_the_count_anew():
    assert felt(in_phase(Phase.PUSH), *[9.0] * 4, *[1.0] * 3, *[9.0] * 4).contact_run == 3, "the median is one late"


@pytest.mark.parametrize("phase", list(Phase))
def test_the_window_of_the_mean_is_filled_only_while_a_contact_is_sought(phase):
    seeks = phase in (Phase.APPROACH, Phase.LOST, Phase.LOST_HOLD)
    before = ContactState(means=(1.0, 0.0, 0.0), bucket_since_ns=NOW - 90 * MS, bucket_count=1)
    found = felt(in_phase(phase, contact=before), 7.0).contact
    assert (found.means, found.bucket_count) == (((1.0, 0.0, 0.0), 2) if seeks else ((), 0))


LIGHT = ContactState(lost_below_N=2.2)


@pytest.mark.parametrize(
    ("phase", "newton", "contact"),
    [
        (Phase.PUSH, 2.3, True),
        (Phase.PUSH, 2.2, True),
        (Phase.PUSH, 2.1, False),
        (Phase.LOST, 4.4, False),
        (Phase.LOST, 5.0, True),
    ],
)
def test_a_contact_goes_on_with_less_than_it_takes_to_find_it_again(phase, newton, contact):
    state = in_phase(phase, contact=LIGHT, force_world=(0.0, newton, 0.0), force_valid=True)
    assert in_contact(SETTINGS, state) is contact
    assert not in_contact(SETTINGS, replace(state, force_valid=False))


def test_a_contact_that_was_lost_is_found_again_by_the_mean_along_the_motion():
    half_a_second = replace(LIGHT, means=(4.4, 0.0, 0.0) * 5)
    state = in_phase(Phase.LOST, contact=half_a_second, force_world=(4.4, 0.0, 0.0), force_valid=True, theta_p=0.0)
    assert in_contact(SETTINGS, state)
    for_a_second = replace(state, contact=replace(LIGHT, means=(4.4, 0.0, 0.0) * 10))
    assert in_contact(SETTINGS, for_a_second), "it need not rise"
    assert not in_contact(SETTINGS, replace(state, theta_p=math.pi / 2)), "across the motion it is no contact"
