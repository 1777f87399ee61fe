"""The phases of a push: settle, tare, approach, push (with loss and recovery of contact), rest, retreat, check."""

from __future__ import annotations

import math

from msgspec.structs import replace

from control import contact_threshold, push_law
from control.sensing import counted, in_contact
from control.settings import Settings
from control.speed_profile import approach_speed, push_speed
from control.steering import steer
from control.tare import Judgement, judge, refusal_in_contact
from control.wrench import force_on_slider_world
from robot_io.messages import LinkState
from robot_io.tick import REST_M_PER_S, REST_NS, ControlState, Operator, Phase, TickInput

FRESH_NS = 100_000_000
SETTLE_PACKETS = 20
"""Packets needed from each device before the run starts."""
MOST_RESUMES = 3
"""After these the operator looks for the cause and starts anew."""
OVERDUE_CONTACT_M = 0.5
"""Without contact this far beyond the expected place, the object is considered missing."""
MOVING = (Phase.APPROACH, Phase.PUSH, Phase.LOST, Phase.RETREAT)
"""Phases that go on only while the base may move. In all others it stands anyway, and they go on while it is held."""
S = 1e-9


def advance(
    settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float], held: bool
) -> ControlState:
    """Return the state after the phase logic of one tick.

    contact: the ball centre in the WORLD frame. held: the supervisor held the base in the tick before, or it is paused.
    """
    along = settings.path.along(*contact)
    progress = along - state.contact_from_m if state.contact_seen else 0.0
    lateral = settings.path.lateral(*contact)
    if math.isfinite(progress) and math.isfinite(lateral):  # they are not before the first valid pose
        state = replace(state, progress_m=progress, lateral_m=lateral)
    state = _note_rest(state, inp)
    state = _note_lost(settings, state, inp, held)
    phase = Phase(state.phase)
    if (held and phase in MOVING) or (inp.paused and phase == Phase.LOST_HOLD):
        return _wait(settings, state, inp)
    if phase == Phase.SETTLE:
        return _settle(settings, state, inp, along)
    if phase == Phase.TARE:
        return _tare(settings, state, inp, along)
    if phase == Phase.APPROACH:
        return _approach(settings, state, inp, along)
    if phase in (Phase.PUSH, Phase.LOST):
        return _push(settings, state, inp, contact)
    if phase == Phase.LOST_HOLD:
        return _lost_hold(settings, state, inp, contact, along)
    if phase == Phase.REST:
        return _rest(settings, state, inp, contact)
    if phase == Phase.RETREAT:
        return _retreat(settings, state, inp, contact)
    if phase == Phase.CHECK:
        return _check(settings, state, inp)
    return replace(state, speed=0.0)


def _enter(state: ControlState, phase: Phase, now_ns: int, **changes: object) -> ControlState:
    return replace(state, phase=int(phase), phase_since_ns=now_ns, tare=(), **changes)


def _wait(settings: Settings, state: ControlState, inp: TickInput) -> ControlState:
    """Suspend the phase's timers while the base is held, so that the speed ramps up again afterwards."""
    since = state.phase_since_ns + round(settings.period_s * (1 + inp.host.skipped) / S)
    if state.phase in (Phase.APPROACH, Phase.RETREAT):
        since = inp.now_ns  # their ramps start from here
    return replace(state, phase_since_ns=since, ramp_since_ns=inp.now_ns, ramp_from_speed=0.0)


def _note_rest(state: ControlState, inp: TickInput) -> ControlState:
    twist = inp.base.odometry
    rest = math.hypot(twist.vx, twist.vy) < REST_M_PER_S and state.speed == 0.0
    since = (state.rest_since_ns or inp.now_ns) if rest else 0
    return state if since == state.rest_since_ns else replace(state, rest_since_ns=since)


def _note_lost(settings: Settings, state: ControlState, inp: TickInput, held: bool) -> ControlState:
    """Add up what is travelled without contact, by the measured speed; a base that is held loses nothing."""
    if state.phase != Phase.LOST or held:
        return state
    ticks, twist = 1 + inp.host.skipped, inp.base.odometry
    speed = math.hypot(twist.vx, twist.vy)
    gone_m = speed * settings.period_s * ticks if math.isfinite(speed) else 0.0
    lost_ns = state.lost_ns + round(settings.period_s / S) * ticks
    return replace(state, lost_ns=lost_ns, lost_m=state.lost_m + gone_m)


def _rested(state: ControlState, now_ns: int, for_ns: int) -> bool:
    # Rest counts only from the start of the phase: the base is also at rest before it has started to move.
    return state.rest_since_ns > 0 and now_ns - max(state.rest_since_ns, state.phase_since_ns) >= for_ns


def all_devices_sent_data(settings: Settings, state: ControlState, inp: TickInput) -> bool:
    """Return whether every device has sent enough fresh data to start."""
    arm, base = inp.arm, inp.base
    return (
        inp.ft.packets_ok >= settings.settle_readings
        and inp.now_ns - state.last_reading_ns <= FRESH_NS
        and arm.link == LinkState.UP
        and arm.packets >= SETTLE_PACKETS
        and inp.now_ns - arm.published_ns <= FRESH_NS
        and base.pose_valid
        and base.pose_seq >= SETTLE_PACKETS
        and inp.now_ns - base.pose_received_ns <= FRESH_NS
        and base.odometry_seq > 0
        and inp.now_ns - base.odometry_received_ns <= FRESH_NS
    )


def _settle(settings: Settings, state: ControlState, inp: TickInput, along: float) -> ControlState:
    if not all_devices_sent_data(settings, state, inp):
        return state
    held = replace(state, held_yaw=inp.base.pose.yaw, approach_from_m=along)
    if settings.in_contact:
        # A saved tare is valid only at the joints where it was taken: those are kept, and a moved arm is a fault (F20).
        return _enter(held, Phase.TARE, inp.now_ns)
    return _enter(held, Phase.TARE, inp.now_ns, held_joints=inp.arm.joints.position)


def _tare(settings: Settings, state: ControlState, inp: TickInput, along: float) -> ControlState:
    if not state.rest_since_ns:  # somebody is moving the base: only readings at rest count
        return replace(state, tare=())
    if state.refusal or counted(state) < settings.tare_readings:
        return state
    judged = judge_tare(settings, state)
    if settings.in_contact:  # the saved tare stays
        mean = judged.tare.bias[:3]
        x, y, z = force_on_slider_world(mean, state.bias_force, settings.base_from_sensor, inp.base.pose.yaw)
        force = (*settings.path.vector_to_path(x, y), z)
        refusal = refusal_in_contact(state.tare[0], settings.scatters, force)
        return replace(state, refusal=int(refusal)) if refusal else _enter(state, Phase.APPROACH, inp.now_ns)
    if judged.refusal:
        return replace(state, refusal=int(judged.refusal))
    bias = judged.tare.bias
    return _enter(
        state,
        Phase.APPROACH,
        inp.now_ns,
        tared=True,
        bias_force=bias[:3],
        bias_torque=bias[3:],
        approach_from_m=along,
    )


def _approach(settings: Settings, state: ControlState, inp: TickInput, along: float) -> ControlState:
    control, travelled = settings.control, along - state.approach_from_m
    direction = settings.path.direction_in_world(0.0)
    # One that is already in contact does not rise.
    by_mean = contact_threshold.found_by_mean(state.contact, direction, rising=not settings.in_contact)
    if by_mean or state.contact_run >= settings.contact_readings:
        expected = settings.expected_contact_m
        early = not state.contact.overdue and contact_threshold.came_early(travelled, expected)
        before = contact_threshold.force_before(state.contact, by_mean=by_mean)
        return _enter(
            state,
            Phase.PUSH,
            inp.now_ns,
            contact_seen=True,
            contact_from_m=along,
            progress_m=0.0,
            ramp_since_ns=inp.now_ns,
            ramp_from_speed=state.speed,
            early_contact=early and not settings.in_contact,
            force_before_contact_N=math.nan if settings.in_contact else before,
        )
    state = replace(state, felt_N=contact_threshold.felt(state.contact, direction))
    if travelled > settings.expected_contact_m + OVERDUE_CONTACT_M:
        overdue = replace(state.contact, overdue=True)
        return _enter(state, Phase.LOST_HOLD, inp.now_ns, speed=0.0, contact=overdue)
    elapsed_s = (inp.now_ns - state.phase_since_ns) * S
    return replace(state, speed=approach_speed(elapsed_s, control.approach_speed_m_per_s, control.ramp_s), theta_p=0.0)


def _push(settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float]) -> ControlState:
    control = settings.control
    remaining = control.distance_m - state.progress_m
    touching = in_contact(settings, state)
    if touching and remaining <= 0.0:
        return _enter(state, Phase.REST, inp.now_ns, speed=0.0)
    elapsed_s = (inp.now_ns - state.ramp_since_ns) * S
    speed = push_speed(
        elapsed_s, state.ramp_from_speed, control.push_speed_m_per_s, settings.ramp_s, max(remaining, 0.001)
    )
    if not touching:
        return _without_force(settings, state, inp, contact, speed)
    if state.phase == Phase.LOST:
        state = _enter(state, Phase.PUSH, inp.now_ns)
    size = math.hypot(state.force_world[0], state.force_world[1])
    state = replace(state, contact=contact_threshold.learn(state.contact, size, state.progress_m, control.force_min_N))
    force = settings.path.vector_to_path(state.force_world[0], state.force_world[1])
    return steer(settings, state, inp, force, speed)


def _without_force(
    settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float], speed: float
) -> ControlState:
    control = settings.control
    if state.phase != Phase.LOST:
        state = _enter(
            state,
            Phase.LOST,
            inp.now_ns,
            anchor_x=contact[0],
            anchor_y=contact[1],
            backward_ticks=0,
            sideways_m=0.0,
            lost_count=state.lost_count + 1,
        )
    gone_s = (inp.now_ns - state.phase_since_ns) * S
    gone_m = math.hypot(contact[0] - state.anchor_x, contact[1] - state.anchor_y)
    if gone_s > control.lost_time_s or gone_m > control.lost_distance_m:
        return _enter(state, Phase.LOST_HOLD, inp.now_ns, speed=0.0)
    k_y = control.k_y_rad_per_m if settings.law.returns_to_path else 0.0
    turn = control.lost_turn_rate_rad_per_s * settings.period_s
    return replace(state, theta_p=push_law.return_angle(state.theta_p, state.lateral_m, k_y, turn), speed=speed)


def _lost_hold(
    settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float], along: float
) -> ControlState:
    state = replace(state, speed=0.0)
    if inp.operator == Operator.RESUME and state.resumes >= MOST_RESUMES:
        state = replace(state, resume_refused=True)
    elif inp.operator == Operator.RESUME:
        state = replace(state, resumes=state.resumes + 1)
        if state.contact_seen:
            return _enter(
                state,
                Phase.LOST,
                inp.now_ns,
                anchor_x=contact[0],
                anchor_y=contact[1],
                ramp_since_ns=inp.now_ns,
                ramp_from_speed=0.0,
            )
        return _enter(state, Phase.APPROACH, inp.now_ns, approach_from_m=along)
    if _rested(state, inp.now_ns, round(settings.control.lost_rest_s / S)):
        return _enter(state, Phase.FAILED, inp.now_ns, end_progress_m=state.progress_m, end_lateral_m=state.lateral_m)
    return state


def _rest(settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float]) -> ControlState:
    if not _rested(state, inp.now_ns, REST_NS):
        return replace(state, speed=0.0)
    after = Phase.RETREAT if settings.control.retreat_m > 0.0 else Phase.DONE
    return _enter(
        state,
        after,
        inp.now_ns,
        end_progress_m=state.progress_m,
        end_lateral_m=state.lateral_m,
        anchor_x=contact[0],
        anchor_y=contact[1],
    )


def _retreat(settings: Settings, state: ControlState, inp: TickInput, contact: tuple[float, float]) -> ControlState:
    control = settings.control
    gone_m = math.hypot(contact[0] - state.anchor_x, contact[1] - state.anchor_y)
    if gone_m >= control.retreat_m:
        return _enter(state, Phase.CHECK, inp.now_ns, speed=0.0)
    elapsed_s = (inp.now_ns - state.phase_since_ns) * S
    speed = approach_speed(elapsed_s, control.approach_speed_m_per_s, control.ramp_s)
    return replace(state, speed=speed, theta_p=math.pi)


def _check(settings: Settings, state: ControlState, inp: TickInput) -> ControlState:
    """Compare the tare with the mean of readings taken at rest again."""
    if not _rested(state, inp.now_ns, REST_NS):
        return replace(state, speed=0.0, tare=())
    if counted(state) < settings.check_readings:
        return state
    mean = judge_tare(settings, state).tare.bias
    return _enter(state, Phase.DONE, inp.now_ns, residual_N=math.dist(mean[:3], state.bias_force))


def judge_tare(settings: Settings, state: ControlState) -> Judgement:
    """Return the tare of the readings summed so far, judged by the figures that the sensor declares."""
    return judge(
        state.tare[0], settings.sensor_noise, settings.sensor_range, settings.sensor_resolution, settings.scatters
    )
