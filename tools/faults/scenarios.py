"""One scenario (or more) for every row of the fault table, in its order. A row without one fails `push faults --run`.

A new row: one line. Words as after `push run --fault`, without the time; what no device can do, from `alterations`.
"""

from __future__ import annotations

import math

from robot_io.geometry import point_outside
from robot_io.tick import Phase, TickInput, TickState
from tools.faults import alterations as do
from tools.faults.bad_laws import BadLaw, Forgetful, Raising, steered_by
from tools.faults.scenario import Moment, Scenario

START, APPROACH, RETREAT, END = Moment.START, Moment.APPROACH, Moment.RETREAT, Moment.END
CALM = (
    'control.law="open-loop"',
    *("world.odometry_noise_m_per_s=0.0", "world.mocap_noise_m=0.0", "world.mocap_noise_deg=0.0"),
)
"""A base that neither moves aside by itself nor seems to, so that it is the fault that brings it near an edge."""
PATIENCE_M = 0.5
EXPECTED_M = 0.05
"""`path.expected_contact_m` of the shipped rigs."""


def _contact_x(inp: TickInput) -> float:
    """Return where the contact ball is by the measured pose, m, WORLD frame: noise of the heading moves it, too."""
    pose, ball = inp.base.pose, do.shipped().frames.contact_in_base_m
    return point_outside(pose.x, pose.y, pose.yaw, ball[0], ball[1])[0]


def far_beyond(inp: TickInput, state: TickState) -> bool:
    """Return whether the search has gone 0.5 m beyond where contact was expected (F53); the path is along x."""
    gone_m = _contact_x(inp) - state.control.approach_from_m
    return state.control.phase >= Phase.APPROACH and gone_m > PATIENCE_M + EXPECTED_M


def backward(_inp: TickInput, state: TickState) -> bool:
    """Return whether the law asks for more than 135 degrees (F56)."""
    return state.control.backward_ticks > 0


def sideways(_inp: TickInput, state: TickState) -> bool:
    """Return whether the law asks for more than 90 degrees (F56-way)."""
    return state.control.sideways_m > 0


def off_by_half(inp: TickInput, _state: TickState) -> bool:
    """Return whether the base has been seen to be off its command by half the push speed of 0.1 m/s (F33)."""
    sent, measured = inp.base.sent, inp.base.odometry
    return math.hypot(measured.vx - sent.vx, measured.vy - sent.vy) > 0.05


def told_to_stop(_inp: TickInput, state: TickState) -> bool:
    """Return whether the command is zero."""
    return state.safety.zero_since_ns > 0


def lost(_inp: TickInput, state: TickState) -> bool:
    """Return whether contact is lost."""
    return state.control.phase in (Phase.LOST, Phase.LOST_HOLD)


def resumed_three_times(_inp: TickInput, state: TickState) -> bool:
    """Return whether three resumes are used up, and the base holds again."""
    return state.control.resumes >= 3 and state.control.phase == Phase.LOST_HOLD


def heavy(_inp: TickInput, state: TickState) -> bool:
    """Return whether the filtered force is above 50 N: three times the usual one, and more."""
    return math.hypot(*state.control.force_world) > 50.0


def touching(_inp: TickInput, state: TickState) -> bool:
    """Return whether the push has begun."""
    return state.control.phase >= Phase.PUSH


def two_cm_on(inp: TickInput, state: TickState) -> bool:
    """Return whether the approach has gone 2 cm, from which on its direction is judged (F59)."""
    return state.control.phase >= Phase.APPROACH and _contact_x(inp) - state.control.approach_from_m > 0.02


SIDEWAYS_TICKS = 299
"""Of 0.3 m at 0.1 m/s, after the one in which it begins."""
LOST_TICKS = 300
"""Contact may stay lost for 3 s (F52)."""

SCENARIOS: tuple[Scenario, ...] = (
    Scenario("R01", "no record of the arm", ("arm.off",), START, standing=True, evidence_ticks=500),
    Scenario("R02", "the sensor scatters", ("ft.garbage=8",), START, standing=True, evidence_ticks=100),
    Scenario("R02-dead", "an axis hardly changes", ("ft.dead-axis=1",), START, standing=True),
    Scenario(
        "R02-contact",
        "it pulls",
        moment=START,
        alter=do.pushed_aside(180.0, 4.0),
        standing=True,
        in_contact=True,
        settings=("world.start.gap_m=0.0",),
    ),
    Scenario("R03", "a large weight on the sensor", ("ft.wrong=0,0,-120",), START, standing=True, evidence_ticks=100),
    Scenario("R04", "the arm is elsewhere", ("arm.wrong=0.06",), START, standing=True),
    Scenario("R05", "odometry creeps", ("base.odometry.wrong=0.015",), START, standing=True, evidence_ticks=500),
    Scenario(
        "R06",
        "starts beyond the workspace",
        moment=START,
        standing=True,
        settings=("workspace.x_m=[0.0, 50.0]", "workspace.y_m=[-50.0, 50.0]"),
    ),
    Scenario("R07", "in millimetres", ("base.pose.wrong=-1500",), START, standing=True),
    Scenario("F01-slow", "silent", ("ft.off",)),
    Scenario("F01-hold", "silent", ("ft.off",)),
    Scenario("F01-stop", "silent", ("ft.off",)),
    Scenario("F02", "unplugged", ("ft.lost",)),
    Scenario("F04", "half of the packets", ("ft.crc=2",)),
    Scenario("F04", "stray bytes in half of them", ("ft.junk=2",)),
    Scenario("F06", "one axis", ("ft.dead-axis=1",)),
    Scenario("F06", "frozen", ("ft.frozen",)),
    *(Scenario("F07", f"axis {axis} at its end", (f"ft.saturated={axis}",)) for axis in range(6)),
    Scenario("F08", "one wild packet", ("ft.spike=96",)),
    Scenario("F09-before", "drifted", ("ft.wrong=4",), APPROACH, settings=("world.start.gap_m=0.2",)),
    Scenario("F09", "moved while pushing", ("ft.wrong=6",), RETREAT, standing=True, evidence_ticks=0),
    Scenario("F10", "not a number", ("ft.garbage",)),
    Scenario("F11", "it lifts", ("ft.wrong=15",), APPROACH, begins=touching),
    Scenario("F12-low", "half of the packets", ("ft.slow=50",)),
    Scenario("F12-hold", "a third of the packets", ("ft.slow=33",)),
    Scenario("F15", "zeroed", ("ft.zeroed",)),
    *(Scenario("F20-hold", f"joint {i} has moved", (f"arm.wrong={'0,' * i}0.006",)) for i in range(6)),
    Scenario("F20-stop", "a joint has moved", ("arm.wrong=0.011",)),
    Scenario("F21", "a joint turns", ("arm.moving=0.03",)),
    Scenario("F22", "protective stop", ("arm.protective-stop",)),
    Scenario("F23", "emergency stop", ("arm.emergency-stop",)),
    Scenario("F24-hold", "silent", ("arm.off",)),
    Scenario("F24-stop", "silent", ("arm.off",)),
    Scenario("F24-stop", "link lost", ("arm.lost",)),
    Scenario("F25-hold", "frozen", ("arm.frozen",)),
    Scenario("F25-stop", "frozen", ("arm.frozen",)),
    Scenario("F27", "powered off", ("arm.powered-off",)),
    Scenario("F27", "may be moved by hand", ("arm.freedrive",)),
    Scenario("F28", "another program", ("arm.other-program",)),
    Scenario("F29", "not a number", ("arm.garbage",)),
    Scenario("F30", "link lost", ("base.command.lost",)),
    Scenario("F31-hold", "no odometry", ("base.odometry.off",)),
    Scenario("F31-stop", "no odometry", ("base.odometry.off",)),
    Scenario("F31-stop", "half-open", ("base.odometry.off", "base.pose.off", "base.status.off")),
    Scenario("F32-slow", "the bridge lags", alter=do.lagging(61.0)),
    Scenario("F32-stop", "the bridge lags", alter=do.lagging(121.0)),
    Scenario("F33", "stands still", ("base.command.ignored",), begins=off_by_half),
    Scenario("F33", "obeys another", ("base.command.wrong=0,0.08",), begins=off_by_half),
    Scenario("F33-way", "a quarter too slow", ("base.command.scaled=0.75",)),
    Scenario("F33-way", "it is told twice a second only", ("base.command.slow=2",)),
    Scenario("F33-way", "15 degrees aside", ("base.command.turned=15",)),
    Scenario("F34", "drives on after a stop", ("base.command.frozen",), alter=do.operator_stop(5), begins=told_to_stop),
    Scenario("F35", "three times as fast", ("base.odometry.scaled=3",)),
    Scenario("F36", "a defect in the speed of approach", core=do.too_fast, moment=APPROACH),
    Scenario("F37", "mirrored", ("base.pose.mirrored",)),
    Scenario("F37", "a third too short", ("base.pose.scaled=0.67",)),
    Scenario("F37", "drifts", ("base.pose.drifting=0,0.05",)),
    Scenario("F38", "stop pressed", ("base.status.e-stop",)),
    Scenario("F38", "motors off", ("base.status.motors-off",)),
    Scenario("F38-late", "its reports stop", ("base.status.off",), evidence_ticks=200),  # the last one is up to 1 s old
    Scenario("F39", "the base creeps", ("base.command.wrong=0.015",), END, standing=True, evidence_ticks=500),
    Scenario("F40-slow", "silent", ("base.pose.off",)),
    Scenario("F40-stop", "silent", ("base.pose.off",)),
    Scenario("F41", "half a metre aside", ("base.pose.wrong=0,0.5",)),
    Scenario("F42", "not usable", ("base.pose.invalid",)),
    Scenario("F42", "not a number", ("base.pose.garbage",)),
    Scenario("F43", "frozen", ("base.pose.frozen",)),
    Scenario("F43", "frozen in the approach", ("base.pose.frozen",), APPROACH),
    Scenario("F44", "turned by 6 degrees", ("base.pose.wrong=0,0,0.105",)),
    Scenario("F45-approach", "no way left", core=do.bounded(approach_m=0.0), moment=APPROACH),
    Scenario("F45-push", "no way left", core=do.bounded(push_m=0.0)),
    Scenario("F45-retreat", "no way left", core=do.bounded(retreat_m=0.0), moment=RETREAT),
    Scenario("F46-approach", "no time left", core=do.bounded(approach_s=0.0), moment=APPROACH),
    Scenario("F46-push", "no time left", core=do.bounded(push_s=0.0)),
    Scenario("F46-retreat", "no time left", core=do.bounded(retreat_s=0.0), moment=RETREAT),
    Scenario("F47", "further than it can need", gate=do.no_way_left),
    Scenario("F48", "longer than it can need", gate=do.no_time_left),
    Scenario("F49", "not a number", ("base.odometry.garbage",)),
    Scenario("F50-slow", "90 N more", ("ft.wrong=0,0,-90",)),
    Scenario("F50-stop", "150 N more", ("ft.wrong=0,0,-150",)),
    Scenario("F51", "23 N m more", ("ft.wrong=0,0,0,23",)),
    Scenario("F52", "the object is gone", alter=do.no_contact),
    Scenario("F52-hold", "the object is gone", alter=do.no_contact, begins=lost, evidence_ticks=LOST_TICKS),
    Scenario("F52-refused", "a fourth time", alter=do.lost_and_resumed, begins=resumed_three_times),
    Scenario("F53-early", "much too soon", moment=START, settings=("path.expected_contact_m=0.7",)),
    Scenario("F53", "nothing there", moment=APPROACH, settings=("world.start.gap_m=1.5",), begins=far_beyond),
    Scenario("F54-stop", "against a wall", ("ft.wrong=0,0,-60", "base.pose.frozen")),
    Scenario(
        "F54-hold",
        "three times the usual force",
        ("ft.wrong=0,0,-120",),
        begins=heavy,
        evidence_ticks=999,
        settings=("control.distance_m=3.0",),
    ),
    Scenario("F55-slow", "drifts aside", ("base.odometry.wrong=0,0.04",), edge_beside_m=0.018, settings=CALM),
    Scenario("F55-stop", "drifts aside", ("base.odometry.wrong=0,0.08",), edge_beside_m=0.018, settings=CALM),
    Scenario("F56", "it pulls", alter=do.pushed_aside(110.0, 15.0), begins=backward),
    Scenario(
        "F56-way",
        "it pushes from the side",
        alter=do.pushed_aside(75.0, 15.0),
        begins=sideways,
        evidence_ticks=SIDEWAYS_TICKS,
    ),
    Scenario("F57", "the law raises an exception", core=steered_by(Raising())),
    Scenario("F57", "its state is of another type", core=steered_by(Forgetful())),
    Scenario("F57-slow", "a step takes 2 ms", alter=do.host(law_ns=2_000_000)),
    Scenario("F58", "a defect in the law", core=steered_by(BadLaw())),
    Scenario("F59", "turned by 25 degrees", ("base.pose.turned=25",), START, begins=two_cm_on),
    Scenario("F60-late", "one tick skipped", alter=do.host_once(1, skipped=1)),
    Scenario("F60-slow", "30 ms", alter=do.host_once(1, skipped=3)),
    Scenario("F60-slow", "three ticks in a row", alter=do.host(skipped=1)),
    Scenario("F61", "suspended", alter=do.host(asleep_ns=20_000_001)),
    Scenario("F63", "recorder gone", alter=do.host(recorder_alive=False)),
    Scenario("F63", "recorder frozen", alter=do.silent("recorder_silent_ns")),
    Scenario("F63", "records lost", alter=do.host(log_dropped=1)),
    Scenario("F64", "stop key", alter=do.operator_stop()),
    Scenario("F65", "control dead", dead=True),
    Scenario("F66", "control silent", silent=True),
    Scenario("F67", "gate gone", alter=do.host(gate_alive=False)),
    Scenario("F67", "gate latched", alter=do.gate_latched),
    Scenario("F67-late", "gate frozen", alter=do.no_gate_record),
    Scenario("F68", "an exception", core=do.failing),
    Scenario("F69", "the arm's process gone", alter=do.host(arm_alive=False)),
    Scenario("F73-hold", "launcher frozen", alter=do.silent("launcher_silent_ns")),
    Scenario("F73-stop", "launcher frozen", alter=do.silent("launcher_silent_ns")),
)
