"""One way (or more) to bring about each row of the fault table, by bad input to the folded core."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from msgspec.structs import replace

from control.sensing import counted
from robot_io.messages import BaseStatus, BodyTwist, Pose2D
from robot_io.tick import ControlState, Operator, Phase, TickInput, TickState
from tests.safety.fold_bench import (
    BIAS,
    GAP_M,
    PERIOD_NS,
    Alter,
    FoldBench,
    pushing,
    ran_to,
    with_force,
    without_contact,
)
from tools.faults.bad_laws import BadLaw, Forgetful, Infinite, Raising, steered_by
from tools.run.tick_core import TickCore

UNFILTERED = ("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0")
BY_THE_GATE = {
    "F65": "control is dead: the gate says it (tests of the gate)",
    "F66": "control is silent: the gate says it (tests of the gate)",
}
"""Rows that no tick of control can raise, each with its reason."""


@dataclass(frozen=True)
class Scenario:
    """`alter` makes the bad input; the ticks are counted after `warm` ticks of it. `also`: faults that may come too."""

    row: str
    what: str
    alter: Alter
    start: Callable[[], FoldBench] = pushing
    warm: int = 0
    also: frozenset[str] = field(default_factory=frozenset)
    before: Callable[[FoldBench], None] = lambda bench: None
    """Done before each altered tick (to let time pass)."""

    def __str__(self) -> str:
        return f"{self.row} {self.what}"


def ft(**changes) -> Alter:
    return lambda inp, _: replace(inp, ft=replace(inp.ft, **changes))


def reading(**changes) -> Alter:
    return lambda inp, _: replace(
        inp, ft=replace(inp.ft, readings=tuple(replace(r, **changes) for r in inp.ft.readings))
    )


def arm(**changes) -> Alter:
    return lambda inp, _: replace(inp, arm=replace(inp.arm, **changes))


def joints(**changes) -> Alter:
    return lambda inp, _: replace(inp, arm=replace(inp.arm, joints=replace(inp.arm.joints, **changes)))


def base(**changes) -> Alter:
    return lambda inp, _: replace(inp, base=replace(inp.base, **changes))


def host(**changes) -> Alter:
    return lambda inp, _: replace(inp, host=replace(inp.host, **changes))


def old(table: str, *keys: str) -> Alter:
    """Make the last of something be what came just in the tick before the first one without it."""

    def alter(inp: TickInput, n: int) -> TickInput:
        at = dict.fromkeys(keys, inp.now_ns - (n + 1) * PERIOD_NS)
        return replace(inp, **{table: replace(getattr(inp, table), **at)})

    return alter


def silent(key: str) -> Alter:
    """Let a process of the run be silent from the first of these ticks on."""
    return lambda inp, n: replace(inp, host=replace(inp.host, **{key: n * PERIOD_NS}))


def moved_joint(by: float, axis: int = 2) -> Alter:
    def alter(inp: TickInput, _: int) -> TickInput:
        position = tuple(q + (by if i == axis else 0.0) for i, q in enumerate(inp.arm.joints.position))
        return replace(inp, arm=replace(inp.arm, joints=replace(inp.arm.joints, position=position)))

    return alter


def shifted_pose(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Alter:
    def alter(inp: TickInput, _: int) -> TickInput:
        pose = inp.base.pose
        return replace(inp, base=replace(inp.base, pose=Pose2D(pose.x + x, pose.y + y, pose.yaw + yaw)))

    return alter


def pressed(newton: float, upward: float = 0.0) -> Alter:
    """Press straight on the ball, minus along the sensor's Z, and upward, along its X; it scatters as before."""

    def alter(inp: TickInput, _: int) -> TickInput:
        scatter = (inp.tick * 7 % 11 - 5) * 0.01
        return with_force(inp, (BIAS[0] + upward + scatter, BIAS[1] + scatter, BIAS[2] - newton + scatter))

    return alter


def frozen_axis(axis: int) -> Alter:
    """Repeat one number of the sensor as it reads at rest; for the push's own axis that is no contact."""

    def alter(inp: TickInput, _: int) -> TickInput:
        one = inp.ft.readings[0]
        values = tuple(BIAS[i] if i == axis else value for i, value in enumerate((*one.force, *one.torque)))
        return reading(force=values[:3], torque=values[3:])(inp, 0)

    return alter


def damaged(every: int) -> Alter:
    """Damage one packet in so many; the others come as before."""
    return lambda inp, n: replace(inp, ft=replace(inp.ft, crc_fail=n // every + 1))


def one_of(every: int) -> Alter:
    """Let one packet in so many arrive."""

    def alter(inp: TickInput, n: int) -> TickInput:
        lost = n + 1 - (n + 1) // every
        readings = inp.ft.readings if (n + 1) % every == 0 else ()
        return replace(inp, ft=replace(inp.ft, readings=readings, packets_ok=inp.ft.packets_ok - lost))

    return alter


def creeping_pose(x: float = 0.0, y: float = 0.0) -> Alter:
    """Shift the pose a little further each tick: m/s."""
    return lambda inp, n: shifted_pose(x * 0.01 * (n + 1), y * 0.01 * (n + 1))(inp, n)


def turned_way(degrees: float, from_x: float) -> Alter:
    """Let the pose go aside of where the base goes, from the place where its x is `from_x`."""

    def alter(inp: TickInput, n: int) -> TickInput:
        way = inp.base.pose.x - from_x
        turn = math.radians(degrees)
        return shifted_pose(way * (math.cos(turn) - 1.0), way * math.sin(turn))(inp, n)

    return alter


def spike(newton: float) -> Alter:
    """Press once, in the first tick only."""
    return lambda inp, n: pressed(newton)(inp, n) if n == 0 else inp


def stuck(newton: float) -> Alter:
    """Press, and let the base stay where it is: the pose lags behind what the bench's base drives at 0.1 m/s."""

    def alter(inp: TickInput, n: int) -> TickInput:
        return shifted_pose(x=-0.001 * n)(pressed(newton)(inp, n), n)

    return alter


def then(*alters: Alter) -> Alter:
    def alter(inp: TickInput, n: int) -> TickInput:
        for one in alters:
            inp = one(inp, n)
        return inp

    return alter


def operator(what: Operator) -> Alter:
    return lambda inp, _: replace(inp, operator=int(what))


WIDE = ("workspace.x_m=[-1.49, 3.0]", "workspace.y_m=[-2.0, 2.0]")
BESIDE = ("workspace.x_m=[-1.49, 3.0]", "workspace.y_m=[-2.0, 0.4065]")
"""The outline's left side is 0.3965 m from the middle: 10 mm of room."""


def beside_the_edge() -> FoldBench:
    """Return a bench that pushes along the left edge of its workspace, 10 mm beside it."""
    return pushing(BESIDE)


def beside_the_start_box() -> FoldBench:
    """Return the same with a rig that gives no workspace: the base has drifted to the edge of its box."""
    bench = pushing()
    left = bench.pose.y + 0.4065
    box = replace(bench.state.safety.workspace, corners_y=(-2.0, -2.0, left, left))
    bench.state = replace(bench.state, safety=replace(bench.state.safety, workspace=box))
    return bench


def starting_too_far_on() -> FoldBench:
    """Return a bench that is about to leave the tare, 0.9 m too far on for its 2 m push."""
    bench = FoldBench(("workspace.x_m=[-1.0, 2.0]", "workspace.y_m=[-2.0, 2.0]"))
    bench.pose = Pose2D(0.4, 0.0, 0.0)
    while counted(bench.state.control) < bench.core.control.tare_readings - 1:
        bench.fold()
    return bench


def object_at(x: float) -> Alter:
    """Let motion capture see the object, 0.354 m about its middle, there."""
    return lambda inp, _: replace(
        inp, base=replace(inp.base, object_pose=Pose2D(x, 0.0, 0.0), object_received_ns=inp.now_ns)
    )


def taring() -> FoldBench:
    bench = ran_to(Phase.TARE)
    for _ in range(5):
        bench.fold()
    return bench


def approaching_too_fast() -> FoldBench:
    """Return a bench whose control has got a speed that no rig may ask for, as by a defect."""
    bench = FoldBench()
    settings = bench.core.control
    fast = replace(settings, control=replace(settings.control, approach_speed_m_per_s=0.2))
    bench.core = replace(bench.core, control=fast)
    bench.run_to(Phase.APPROACH)
    for _ in range(70):
        bench.fold()
    return bench


def approaching_at_full_speed() -> FoldBench:
    """Return a bench on a long approach, at its 0.05 m/s."""
    bench = ran_to(Phase.APPROACH)
    for n in range(150):
        bench.fold(without_contact, n)
    return bench


def just_before_contact(overrides: tuple[str, ...] = (), alter: Alter | None = None) -> FoldBench:
    """Return a bench at the approach's full speed, 1 cm before the object."""
    bench = ran_to(Phase.APPROACH, overrides)
    bench.run_until(lambda b: b.pose.x + 1.0 >= GAP_M - 0.01, alter)
    return bench


def touching_backward() -> FoldBench:
    """Return a bench in its first tick of contact, whose sensor says that the object pulls."""
    bench = ran_to(Phase.APPROACH)
    bench.force_path = (-15.0, 0.0)
    return bench.run_to(Phase.PUSH)


def pushing_for_a_while(overrides: tuple[str, ...] = ()) -> FoldBench:
    """Return a bench that has pushed with 15 N for 4 s."""
    bench = pushing(overrides)
    for _ in range(300):
        bench.fold()
    return bench


def in_contact_at_rest() -> FoldBench:
    """Return a bench that has begun in contact, with a saved tare, and looks at the force before it moves."""
    bench = FoldBench()
    bench.core = TickCore.of(bench.rig, in_contact=True)
    bench.pose = Pose2D(-0.95, 0.0, 0.0)
    joints = bench.rig.arm.held_pose_rad
    bench.state = TickState(ControlState(tared=True, bias_force=BIAS[:3], bias_torque=BIAS[3:], held_joints=joints))
    return bench.run_to(Phase.TARE)


def approaching_in_vain() -> FoldBench:
    """Return a bench whose next tick sees the ball more than 0.5 m beyond the expected contact."""
    bench = ran_to(Phase.APPROACH)
    while bench.pose.x + 1.0 - bench.state.control.approach_from_m <= 0.55:
        bench.fold(without_contact)
    return bench


def far_on(phase: Phase, after_ticks: int = 0, **changes: float) -> Callable[[], FoldBench]:
    """Return a way to a bench that has nearly used up what safety allows this phase."""

    def start() -> FoldBench:
        bench = pushing() if phase == Phase.PUSH else ran_to(phase)
        for _ in range(after_ticks):
            bench.fold()
        motion = replace(bench.state.safety.motion, **changes)
        bench.state = replace(bench.state, safety=replace(bench.state.safety, motion=motion))
        return bench

    return start


def resumed_three_times() -> FoldBench:
    bench = lost_for_good()
    bench.state = replace(bench.state, control=replace(bench.state.control, resumes=3))
    return bench


def pushed(phase: Phase) -> FoldBench:
    """Return a bench that has pushed its distance and come to a phase behind that."""
    return pushing().run_to(phase)


def lost_for_good() -> FoldBench:
    bench = pushing(UNFILTERED)
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, without_contact)
    return bench


def pushing_sideways() -> FoldBench:
    """Return a bench whose force points 75 degrees off from the next tick on: 97.5 degrees wanted."""
    bench = pushing((*UNFILTERED, "control.distance_m=3.0"))
    bench.force_path = (15.0 * math.cos(math.radians(75)), 15.0 * math.sin(math.radians(75)))
    return bench


def pushing_backward() -> FoldBench:
    """Return a bench whose force points 110 degrees off from the next tick on: 143 degrees wanted."""
    bench = pushing_for_a_while(UNFILTERED)
    bench.force_path = (15.0 * math.cos(math.radians(110)), 15.0 * math.sin(math.radians(110)))
    return bench


def pushing_by(law: BadLaw) -> Callable[[], FoldBench]:
    """Return a function that returns a bench whose law has a defect from the next tick on."""

    def start() -> FoldBench:
        bench = pushing()
        bench.core = steered_by(law)(bench.core)
        return bench

    return start


def shaking(inp: TickInput, n: int) -> TickInput:
    one = inp.ft.readings[0]
    return with_force(inp, (one.force[0] + 5.0 * (-1) ** n, one.force[1], one.force[2]))


def alternate_torque(inp: TickInput, n: int) -> TickInput:
    return reading(torque=(21.0 + BIAS[3], BIAS[4] + 0.001 * n, BIAS[5]))(inp, n)


CREEPS = then(base(odometry=BodyTwist(0.015, 0.0, 0.0)), creeping_pose(x=0.015))
"""Above what counts as rest, below what counts as moving (F34) or as ignoring the command (F33)."""
NAN = math.nan
SERVO = ('arm.hold="servo"',)
SCENARIOS = [
    # --- start
    Scenario("R01", "no arm", arm(packets=3), FoldBench, warm=500),
    Scenario("R02", "somebody shakes the tool", shaking, lambda: ran_to(Phase.TARE), warm=99),
    Scenario(
        "R03", "something hangs on the tool", reading(force=(0.0, 0.0, 151.0)),
        lambda: ran_to(Phase.TARE, ("ft.noise_force_N=0", "ft.noise_torque_Nm=0")), warm=99,
        also=frozenset({"R02"}),
    ),
    *(
        Scenario("R02-dead", f"axis {i}", frozen_axis(i), lambda: ran_to(Phase.TARE), warm=99)
        for i in range(6)
    ),
    Scenario("R02-dead", "in contact", frozen_axis(4), in_contact_at_rest, warm=99),
    Scenario("R02-contact", "it pulls", pressed(-4.0), in_contact_at_rest, warm=99),
    Scenario("R02-contact", "it lifts", pressed(9.0, upward=5.0), in_contact_at_rest, warm=99),
    Scenario("R05", "odometry creeps", CREEPS, lambda: ran_to(Phase.TARE), warm=500),
    Scenario("R04", "arm elsewhere", moved_joint(0.051), FoldBench, warm=19),
    # --- force-torque sensor
    Scenario("F01-slow", "silent", ft(readings=())),
    Scenario("F01-hold", "silent", ft(readings=())),
    Scenario("F01-stop", "silent", ft(readings=()), also=frozenset({"F52"})),
    Scenario("F02", "unplugged", ft(link=3)),
    Scenario("F15", "zeroed", ft(bias_jumps=1)),
    Scenario("F04", "half of the packets", damaged(2)),
    Scenario("F04", "one in four", damaged(4)),
    Scenario("F06", "frozen", reading(force=(BIAS[0], BIAS[1], BIAS[2] - 15.0), torque=BIAS[3:])),
    *(
        Scenario("F06", f"axis {i}", frozen_axis(i), also=frozenset({"F52"} if i == 2 else ())) for i in range(6)
    ),
    *(
        Scenario("F07", f"force axis {i}, {sign:+.0f}", reading(force=tuple(sign * 285.0 * (i == k) for k in range(3))),
                 taring)
        for i in range(3) for sign in (1.0, -1.0)
    ),
    *(
        Scenario("F07", f"torque axis {i}, {sign:+.0f}",
                 reading(torque=tuple(sign * 28.5 * (i == k) for k in range(3))), taring)
        for i in range(3) for sign in (1.0, -1.0)
    ),
    Scenario("F07", "while pushing", pressed(340.0), also=frozenset({"F50-stop"})),
    Scenario("F08", "one wild packet", spike(96.0)),
    Scenario("F09", "drifted", pressed(0.0, upward=6.0), lambda: pushed(Phase.RETREAT)),
    Scenario("F09-before", "drifted", lambda inp, n: pressed(15.0 if n > 20 else 0.0, upward=4.0)(inp, n),
             lambda: just_before_contact(alter=pressed(0.0, upward=4.0))),
    Scenario("F10", "NaN", reading(force=(NAN, 0.0, 0.0)), also=frozenset({"F52"})),
    Scenario("F10", "infinite", reading(force=(0.0, -math.inf, 0.0)), also=frozenset({"F52"})),
    Scenario("F10", "torque NaN", reading(torque=(0.0, 0.0, NAN))),
    Scenario("F10", "NaN while taring", reading(force=(0.0, 0.0, NAN)), taring),
    Scenario("F11", "lifts", pressed(15.0, upward=9.0), lambda: ran_to(Phase.PUSH)),
    Scenario("F11", "presses down", pressed(15.0, upward=-9.0), lambda: ran_to(Phase.PUSH)),
    Scenario("F11", "pulls", lambda inp, _: inp, touching_backward),
    Scenario("F12-low", "half of the packets", one_of(2)),
    Scenario("F12-hold", "a third of the packets", one_of(3)),
    # --- arm
    *(Scenario("F20-hold", f"joint {i}", moved_joint(0.006 * (-1) ** i, i)) for i in range(6)),
    Scenario("F20-stop", "drift", moved_joint(-0.0101)),
    Scenario("F20-stop", "no longer held actively", arm(servo=False), lambda: pushing(SERVO)),
    Scenario("F21", "joint moves", joints(velocity=(0.0, 0.0, 0.0, -0.021, 0.0, 0.0))),
    Scenario("F22", "protective stop", joints(state=3)),
    Scenario("F23", "emergency stop", joints(state=4)),
    Scenario("F24-hold", "no record", old("arm", "published_ns", "changed_ns")),
    Scenario("F24-stop", "no record", old("arm", "published_ns", "changed_ns")),
    Scenario("F24-stop", "link lost", arm(link=3)),
    Scenario("F25-hold", "frozen", old("arm", "changed_ns")),
    Scenario("F25-stop", "frozen", old("arm", "changed_ns")),
    Scenario("F27", "state unknown", joints(state=0)),
    Scenario("F27", "moved by hand", joints(state=2)),
    Scenario("F27", "switched off", joints(state=5)),
    Scenario("F28", "a program runs", joints(state=6)),
    Scenario("F29", "NaN position", joints(position=(0.0, NAN, 0.0, 0.0, 0.0, 0.0))),
    Scenario("F29", "infinite velocity", joints(velocity=(0.0, 0.0, 0.0, 0.0, 0.0, math.inf))),
    Scenario("F69", "process gone", host(arm_alive=False)),
    # --- base, localisation, gate
    Scenario("F30", "reset", base(latched=True, latch_cause=11)),
    Scenario("F31-hold", "no odometry", old("base", "odometry_received_ns")),
    Scenario("F31-stop", "no odometry", old("base", "odometry_received_ns")),
    Scenario(
        "F31-hold", "half-open", old("base", "odometry_received_ns", "pose_received_ns", "newest_inbound_ns"),
        also=frozenset({"F40-slow"}),
    ),
    Scenario("F32-slow", "lags", base(lag_ns=60_000_001)),
    Scenario("F32-stop", "lags", base(lag_ns=120_000_001)),
    Scenario("F33", "stands", then(base(odometry=BodyTwist()), creeping_pose(x=-0.1))),
    Scenario("F33", "goes elsewhere", then(base(odometry=BodyTwist(0.1, 0.06, 0.0)), creeping_pose(y=0.06))),
    Scenario("F33", "stands while approaching", then(base(odometry=BodyTwist()), creeping_pose(x=-0.05)),
             approaching_at_full_speed),
    Scenario("F33-way", "a third too slow", then(base(odometry=BodyTwist(0.067, 0.0, 0.0)), creeping_pose(x=-0.033))),
    Scenario("F33-way", "a quarter too slow", then(base(odometry=BodyTwist(0.075, 0.0, 0.0)), creeping_pose(x=-0.025))),
    Scenario("F33-way", "a third too fast", then(base(odometry=BodyTwist(0.133, 0.0, 0.0)), creeping_pose(x=0.033))),
    Scenario("F33-way", "aside", then(base(odometry=BodyTwist(0.0966, 0.0259, 0.0)), creeping_pose(-0.0034, 0.0259))),
    Scenario("F37", "mirrored", creeping_pose(x=-0.2)),
    Scenario("F37", "a quarter too short", creeping_pose(x=-0.025)),
    Scenario("F37", "a third too long", creeping_pose(x=0.033)),
    Scenario("F37", "turned left", creeping_pose(-0.0034, 0.0259)),
    Scenario("F37", "turned right", creeping_pose(-0.0034, -0.0259)),
    Scenario("F37", "drifts", creeping_pose(y=0.05)),
    Scenario("F37", "drifts while approaching", creeping_pose(y=-0.05), approaching_at_full_speed),
    Scenario("F37", "turns", lambda inp, n: shifted_pose(yaw=0.001 * n)(inp, n)),
    Scenario(
        "F34", "rolls on", then(operator(Operator.STOP), base(odometry=BodyTwist(0.1, 0.0, 0.0))),
        also=frozenset({"F64"}),
    ),
    Scenario("F35", "too fast", base(odometry=BodyTwist(0.14, 0.14, 0.0))),
    Scenario("F35", "turns too fast", base(odometry=BodyTwist(0.1, 0.0, -0.33))),
    Scenario("F36", "approach beyond the envelope", without_contact, approaching_too_fast),
    Scenario("F38", "stop pressed", base(status=BaseStatus(True, True, 26.0))),
    Scenario("F38", "motors off", base(status=BaseStatus(False, False, 26.0))),
    Scenario("F38-late", "no report", old("base", "status_received_ns")),
    Scenario("F39", "creeps after the push", CREEPS, lambda: pushed(Phase.REST), warm=500),
    Scenario("F39", "creeps while the zero is checked", CREEPS, lambda: pushed(Phase.CHECK), warm=500,
             also=frozenset({"F45-retreat"})),
    Scenario("F39", "creeps after the force was lost", then(CREEPS, without_contact), lost_for_good, warm=500,
             also=frozenset({"F52-hold"})),
    Scenario("F40-slow", "silent", old("base", "pose_received_ns")),
    Scenario("F40-stop", "silent", old("base", "pose_received_ns")),
    Scenario("F41", "away", shifted_pose(x=0.5)),
    Scenario("F41", "aside", shifted_pose(y=-0.5)),
    Scenario("F41", "turned", shifted_pose(yaw=0.06)),
    Scenario("F42", "not valid", base(pose_valid=False)),
    *(
        Scenario("F42", f"NaN {key}", base(pose=replace(Pose2D(), **{key: NAN})))
        for key in ("x", "y", "yaw")
    ),
    Scenario("F43", "stands", creeping_pose(x=-0.1)),
    Scenario("F43", "stands while approaching", creeping_pose(x=-0.05), approaching_at_full_speed),
    Scenario("F44", "turned left", shifted_pose(yaw=0.088)),
    Scenario("F44", "turned right", shifted_pose(yaw=-0.088)),
    Scenario("F49", "null along", base(odometry=BodyTwist(NAN, 0.0, 0.0))),
    Scenario("F49", "null turn", base(odometry=BodyTwist(0.1, 0.0, NAN))),
    Scenario("F67", "latched", base(latched=True, latch_cause=1)),
    Scenario("F67", "gone", host(gate_alive=False)),
    Scenario("F67-late", "frozen", old("base", "published_ns")),
    Scenario("F47", "further than it can need", base(latched=True, latch_cause=14, travel_m=9.0)),
    Scenario("F48", "longer than it can need", base(latched=True, latch_cause=15, moving_s=900.0)),
    # What the shipped rig can need: 0.655 m and 28.2 s, 3.13 m and 74.6 s, 0.105 m and 6.2 s (docs/safety.md).
    Scenario("F45-approach", "search", without_contact, far_on(Phase.APPROACH, 80, sent_m=0.6549)),
    Scenario("F45-approach", "search, measured", without_contact, far_on(Phase.APPROACH, 80, measured_m=0.6549)),
    Scenario("F45-push", "push", creeping_pose(), far_on(Phase.PUSH, sent_m=3.1299)),
    Scenario("F45-retreat", "retreat", creeping_pose(), far_on(Phase.RETREAT, 40, measured_m=0.1049)),
    Scenario("F46-approach", "search", without_contact, far_on(Phase.APPROACH, 80, moving_ns=28_195_000_000)),
    Scenario("F46-push", "push", creeping_pose(), far_on(Phase.PUSH, moving_ns=74_595_000_000)),
    Scenario("F46-retreat", "retreat", creeping_pose(), far_on(Phase.RETREAT, 40, moving_ns=6_195_000_000)),
    Scenario("F59", "aside in the approach", turned_way(20.0, -1.0), lambda: ran_to(Phase.APPROACH),
             warm=85, also=frozenset({"F37"})),
    Scenario("F59", "aside in the push", turned_way(-20.0, -0.95), lambda: ran_to(Phase.PUSH),
             warm=20, also=frozenset({"F37"})),
    Scenario("F52-refused", "a fourth time", then(operator(Operator.RESUME), without_contact), resumed_three_times,
             also=frozenset({"F52-hold"})),
    Scenario("R07", "in millimetres", shifted_pose(x=-1500.0), FoldBench, warm=19),
    Scenario("R07", "far aside", shifted_pose(y=1000.1), FoldBench, warm=19),
    # --- force and task
    Scenario("F50-slow", "pressed", pressed(101.0)),
    Scenario("F50-stop", "pressed", pressed(151.0)),
    Scenario("F50-stop", "from above", lambda inp, _: with_force(inp, (BIAS[0] + 151.0, BIAS[1], BIAS[2])),
             also=frozenset()),
    Scenario("F51", "twisted", alternate_torque),
    Scenario("F52", "no force", without_contact, lambda: pushing(UNFILTERED)),
    Scenario("F52-hold", "no force", without_contact, lambda: pushing(UNFILTERED), warm=300,
             also=frozenset({"F52"})),
    Scenario("F53", "nothing there", without_contact, approaching_in_vain),
    Scenario("R06", "starts too far on", lambda inp, _: inp, starting_too_far_on, also=frozenset({"F55-slow"})),
    Scenario("F55-slow", "drifts", base(odometry=BodyTwist(0.1, 0.02, 0.0)), beside_the_edge),
    Scenario("F55-slow", "drifts beside the box from the start", base(odometry=BodyTwist(0.1, 0.02, 0.0)),
             beside_the_start_box),
    Scenario("F55-stop", "drifts", base(odometry=BodyTwist(0.1, 0.05, 0.0)), beside_the_edge),
    Scenario("F55-stop", "drifts beside the box from the start", base(odometry=BodyTwist(0.1, 0.05, 0.0)),
             beside_the_start_box),
    Scenario("F55-stop", "object", object_at(2.64), lambda: pushing(WIDE)),
    Scenario("F53-early", "much too soon", lambda inp, _: inp,
             lambda: just_before_contact(("path.expected_contact_m=0.7",))),
    Scenario("F54-stop", "against a wall", stuck(60.0)),
    Scenario("F54-hold", "110 N", pressed(110.0), warm=1002, also=frozenset({"F50-slow"})),
    Scenario("F54-hold", "four times the usual", pressed(62.0), pushing_for_a_while, warm=1006),
    Scenario("F56", "backward", lambda inp, _: inp, pushing_backward),
    Scenario("F56-way", "sideways", lambda inp, _: inp, pushing_sideways, warm=300),
    Scenario("F57", "it raises", lambda inp, _: inp, pushing_by(Raising())),
    Scenario("F57", "another state", lambda inp, _: inp, pushing_by(Forgetful())),
    Scenario("F57-slow", "1 ms and a bit", host(law_ns=1_000_001)),
    Scenario("F58", "no number", lambda inp, _: inp, pushing_by(BadLaw())),
    Scenario("F58", "infinite", lambda inp, _: inp, pushing_by(Infinite())),
    # --- host
    Scenario("F60-late", "one tick skipped", host(skipped=1), before=lambda b: b.skip(1)),
    Scenario("F60-slow", "30 ms", host(skipped=3), before=lambda b: b.skip(3), also=frozenset({"F60-late"})),
    Scenario("F60-slow", "three in a row", host(skipped=1), before=lambda b: b.skip(1),
             also=frozenset({"F60-late"})),
    Scenario("F61", "suspended", host(asleep_ns=20_000_001)),
    Scenario("F61", "its clock went back", host(asleep_ns=-20_000_001)),
    Scenario("F63", "gone", host(recorder_alive=False)),
    Scenario("F63", "frozen", silent("recorder_silent_ns")),
    Scenario("F63", "records lost", host(log_dropped=1)),
    Scenario("F64", "stop key", operator(Operator.STOP)),
    Scenario("F73-hold", "frozen", silent("launcher_silent_ns")),
    Scenario("F73-stop", "frozen", silent("launcher_silent_ns")),
    Scenario("F68", "exception", host(loop_error=True)),
]  # fmt: skip
