"""The gate around its judgement: what it takes, sends, publishes and logs, and when it ends, in numbers of the docs.

A push sends 100 frames a second; control's silence of 50 ms and the gate's own pause of 100 ms latch; after control's
end zeros go on for half a second at most, or until odometry that can know of them (120 ms) shows rest.
"""

import pytest
from msgspec.structs import replace

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import (
    NO_BASE,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    CommandEcho,
    DeviceHealth,
    LinkState,
    Pose2D,
    SliderPose,
    Stamped,
)
from safety.envelope import EnvelopeLimits
from safety.gate import Latch
from safety.gate_shell import GateShell, Latching
from safety.motion_bounds import TravelLimits

MS = 1_000_000
T0 = 5_000 * MS
NEW = GateShell(EnvelopeLimits(0.15, 0.25, 0.5, 1.0, 10 * MS, 0.0, 0.0), TravelLimits(2.0, 30.0), T0)
SLOW, ZERO, FAST = BodyTwist(0.005, 0.0, 0.0), BodyTwist(), BodyTwist(0.3, 0.0, 0.0)
UP = DeviceHealth(LinkState.UP, "", {}, 100.0)
GONE = DeviceHealth(LinkState.LOST, "the bridge closed the connection", {}, 0.0)


def frame(seq, now_ns, twist=SLOW):
    return GateFrame(seq, seq + 40, now_ns, 2, twist)


def rolling():
    """Return a gate that let one slow command out at T0."""
    shell, latching = NEW.on_frames([frame(1, T0)], T0, T0).on_leaving(T0)
    assert latching is None
    assert shell.due(T0) == SLOW
    return shell.on_sent(SLOW, SLOW, T0)


def heard(value, at_ms):
    return Stamped(value, 0, T0 + at_ms * MS, 0.0)


def left_behind():
    """Return a gate whose control ended 10 ms after T0."""
    return rolling().on_control_gone(T0 + 10 * MS)


def published(shell, at_ms):
    return shell.on_publish(T0 + at_ms * MS, newest_inbound_ns=7, newest_pong_ns=8)


# --- what is taken -----------------------------------------------------------------------------------------------


def test_nothing_leaves_before_the_first_frame():
    shell, latching = NEW.on_clock(T0 + 90 * MS, UP).on_leaving(T0 + 90 * MS)
    assert (latching, shell.due(T0 + 90 * MS)) == (None, None)


def test_only_accepted_frames_are_accepted():
    shell = rolling()
    assert (shell.record.accepted_seq, shell.record.verdict) == (1, 0)
    after = shell.on_frames([frame(3, T0 + 10 * MS)], T0 + 10 * MS, T0 + 10 * MS)
    assert (after.record.accepted_seq, after.record.verdict) == (1, 4)  # one is missing: SEQUENCE
    nonsense = shell.on_frames([None], T0 + 10 * MS, T0 + 10 * MS)
    assert (nonsense.record.accepted_seq, nonsense.record.verdict) == (1, 3)
    assert after.on_frames([frame(2, T0 + 20 * MS)], T0 + 20 * MS, T0 + 20 * MS).record.accepted_seq == 1


def test_no_frame_changes_nothing():
    assert rolling().on_frames([], T0 + 10 * MS, T0 + 10 * MS) == rolling()


def test_a_pause_while_frames_are_read_is_no_silence_of_control():
    """It falls between the look at the clock and the first frame, and seven frames come meanwhile."""
    frames = [frame(2 + n, T0 + (n + 1) * 10 * MS) for n in range(7)]
    shell = rolling().on_frames(frames, T0, T0 + 70 * MS)
    assert shell.record.accepted_seq == 8
    assert shell.on_clock(T0 + 120 * MS, UP).gate.latch == Latch.NONE
    assert shell.on_clock(T0 + 120 * MS + 1, UP).gate.latch == Latch.SILENCE


def test_a_pause_after_the_look_at_the_clock_makes_no_frame_old():
    shell = rolling().on_frames([frame(2, T0 + 10 * MS)], T0 + 12 * MS, T0 + 82 * MS)
    assert (shell.gate.latch, shell.record.accepted_seq) == (Latch.NONE, 2)
    stale = rolling().on_frames([frame(2, T0 + 10 * MS)], T0 + 60 * MS + 1, T0 + 60 * MS + 1)
    assert (stale.gate.latch, stale.record.accepted_seq) == (Latch.STALE, 1)


def test_what_the_base_says_is_in_the_record():
    shell = NEW.on_samples(
        [
            heard(BasePose(Pose2D(1.0, 2.0, 0.5)), 1),
            heard(BaseOdometry(BodyTwist(0.1, 0.0, 0.01)), 2),
            heard(SliderPose(Pose2D(9.0, 9.0, 0.0)), 3),
            heard(CommandEcho(SLOW), 4),
            heard(BasePose(Pose2D(1.1, 2.0, 0.5), "no unit quaternion"), 5),
            heard(BaseReport(BaseStatus(False, True, 26.5)), 6),
            heard(SliderPose(Pose2D(8.0, 8.0, 0.0), "no unit quaternion"), 7),
        ]
    )
    assert shell.record == replace(
        NO_BASE,
        pose=Pose2D(1.1, 2.0, 0.5),
        pose_valid=False,
        pose_received_ns=T0 + 5 * MS,
        pose_seq=2,
        odometry=BodyTwist(0.1, 0.0, 0.01),
        odometry_received_ns=T0 + 2 * MS,
        odometry_seq=1,
        status=BaseStatus(False, True, 26.5),
        status_received_ns=T0 + 6 * MS,
        object_pose=Pose2D(9.0, 9.0, 0.0),
        object_received_ns=T0 + 3 * MS,
    )
    assert NEW.on_samples([heard(CommandEcho(SLOW), 1)]) == NEW
    assert NEW.on_samples([heard(BasePose(Pose2D(1.0, 2.0, 0.5)), 1)]).record.pose_valid


def test_three_speeds_in_a_row_beyond_the_envelope_latch():
    two = rolling().on_samples([heard(BaseOdometry(FAST), 1), heard(BaseOdometry(FAST), 21)])
    assert two.gate.latch == Latch.NONE
    assert two.on_samples([heard(BaseOdometry(FAST), 41)]).gate.latch == Latch.OVERSPEED


# --- what latches, and what is said of it ------------------------------------------------------------------------


def told(shell, at_ms):
    return shell.on_leaving(T0 + at_ms * MS)[1]


def test_silence_latches_after_50_ms():
    assert told(rolling().on_clock(T0 + 50 * MS, UP), 50) is None
    late = rolling().on_clock(T0 + 50 * MS + 1, UP)
    assert told(late, 51) == Latching(1, 41, Latch.SILENCE, "control was silent for 50 ms", "F66")


def test_an_own_pause_of_more_than_100_ms_latches_whatever_was_read_meanwhile():
    frames = [frame(2, T0 + 50 * MS), frame(3, T0 + 100 * MS)]
    shell = rolling().on_frames(frames, T0 + 100 * MS, T0 + 100 * MS)
    assert told(shell, 100) is None
    frozen, latching = shell.on_leaving(T0 + 100 * MS + 1)
    assert latching == Latching(3, 43, Latch.PAUSED, "the gate itself was frozen for more than 100 ms", "F67")
    assert frozen.due(T0 + 100 * MS + 1) == ZERO


def test_leaving_is_what_shows_that_the_gate_runs():
    frames = [frame(2, T0 + 45 * MS), frame(3, T0 + 90 * MS)]
    shell, _ = rolling().on_frames(frames, T0 + 90 * MS, T0 + 90 * MS).on_leaving(T0 + 90 * MS)
    assert told(shell, 190) is None


def test_control_and_gate_frozen_together_for_80_ms_latch():
    """Both wake at once: the frame is fresh, and what says so is the gap before it."""
    woken = rolling().on_frames([frame(2, T0 + 80 * MS)], T0 + 80 * MS, T0 + 80 * MS).on_clock(T0 + 80 * MS, UP)
    assert told(woken, 80) == Latching(1, 41, Latch.SILENCE, "control was silent for 50 ms", "F66")
    assert woken.due(T0 + 80 * MS) == ZERO
    at_the_limit = rolling().on_frames([frame(2, T0 + 50 * MS)], T0 + 50 * MS, T0 + 50 * MS)
    assert told(at_the_limit, 50) is None
    beyond = rolling().on_frames([frame(2, T0 + 50 * MS + 1)], T0 + 50 * MS + 1, T0 + 50 * MS + 1)
    assert told(beyond, 50.001).latch == Latch.SILENCE


def test_a_lost_link_latches_and_is_named():
    latching = told(rolling().on_clock(T0 + 10 * MS, GONE), 10)
    assert latching is not None
    assert (latching.latch, latching.fault) == (Latch.LINK, "F30")
    assert latching.text == "the base link is gone: the bridge closed the connection"


def test_a_link_lost_behind_another_latch_is_not_named():
    latching = told(rolling().on_clock(T0 + 51 * MS, GONE), 51)
    assert latching is not None
    assert (latching.latch, latching.text) == (Latch.SILENCE, "control was silent for 50 ms")


@pytest.mark.parametrize(
    ("frames", "latch", "fault"),
    [([None], Latch.NONSENSE, "F36"), ([frame(2, T0 + MS, FAST)], Latch.ENVELOPE, "F36")],
)
def test_a_bad_frame_is_a_fault_of_its_own(frames, latch, fault):
    latching = told(rolling().on_frames(frames, T0 + 10 * MS, T0 + 10 * MS), 10)
    assert latching is not None
    assert (latching.latch, latching.fault) == (latch, fault)


def test_the_normal_end_is_no_fault_and_a_death_in_motion_is():
    at_rest = rolling().on_frames([frame(2, T0 + 9 * MS, ZERO)], T0 + 9 * MS, T0 + 9 * MS).on_control_gone(T0 + 10 * MS)
    assert told(at_rest, 10) == Latching(2, 42, Latch.EOF, "control has ended", "")
    moving = told(left_behind(), 10)
    assert moving is not None
    assert (moving.latch, moving.fault) == (Latch.EOF_MOVING, "F65")


def test_a_latch_is_told_once_and_the_first_cause_stays():
    shell, first = rolling().on_clock(T0 + 10 * MS, GONE).on_leaving(T0 + 10 * MS)
    assert first is not None
    later = shell.on_frames([None], T0 + 20 * MS, T0 + 20 * MS).on_control_gone(T0 + 30 * MS)
    assert told(later, 30) is None
    assert later.gate.latch == Latch.LINK


# --- what leaves -------------------------------------------------------------------------------------------------


def test_a_latched_gate_sends_zero_at_once():
    shell = rolling().on_clock(T0 + 10 * MS, GONE)
    assert shell.due(T0 + 10 * MS) == ZERO


def test_over_a_lost_link_nothing_counts_as_sent():
    shell = rolling().on_sent(ZERO, None, T0 + 10 * MS)
    assert (shell.record.sent, shell.record.sent_ns) == (SLOW, T0)
    assert shell.due(T0 + 20 * MS) is None  # and it is not tried again before its turn
    assert rolling().on_sent(SLOW, ZERO, T0 + 20 * MS).record.sent == ZERO  # what the driver really sent


def test_a_record_leaves_every_10_ms_and_says_what_the_gate_is_in():
    shell = published(rolling(), 3)
    assert (shell.record.published_ns, shell.record.latched, shell.record.latch_cause) == (T0 + 3 * MS, False, 0)
    assert (shell.record.newest_inbound_ns, shell.record.newest_pong_ns) == (7, 8)
    assert not shell.publish_due(T0 + 13 * MS - 1)
    assert shell.publish_due(T0 + 13 * MS)
    latched = published(shell.on_clock(T0 + 4 * MS, GONE), 4)
    assert (latched.record.latched, latched.record.latch_cause, latched.record.verdict) == (True, 11, 0)


# --- when it ends ------------------------------------------------------------------------------------------------


def ends(shell, at_ms, link=LinkState.UP):
    return shell.ends(T0 + at_ms * MS, link)


def test_it_never_ends_while_control_is_there():
    latched = rolling().on_clock(T0 + 10 * MS, GONE)
    assert not ends(latched, 10_000, LinkState.LOST)


def test_the_last_zeros_end_500_ms_after_control():
    assert not ends(left_behind(), 509)
    assert ends(left_behind(), 510)


def test_over_a_lost_link_they_are_in_vain():
    assert ends(left_behind(), 11, LinkState.LOST)


@pytest.mark.parametrize(
    ("measured", "at_ms", "over"),
    [
        (ZERO, 130, False),
        (ZERO, 131, True),
        (BodyTwist(0.0049, -0.0049, 0.0049), 131, True),
        (BodyTwist(0.005, 0.0, 0.0), 131, False),
        (BodyTwist(0.0, -0.005, 0.0), 131, False),
        (BodyTwist(0.0, 0.0, 0.005), 131, False),
        (BodyTwist(-0.005, 0.0, 0.0), 131, False),
        (BodyTwist(0.0, 0.0, -0.005), 131, False),
        (BodyTwist(float("nan"), 0.0, 0.0), 131, False),
    ],
)
def test_they_end_when_odometry_that_can_know_of_them_shows_rest(measured, at_ms, over):
    shell = left_behind().on_samples([heard(BaseOdometry(measured), at_ms)])
    assert ends(shell, 140) == over
