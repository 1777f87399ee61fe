"""The shipped laws by hand, and what becomes of a law that does wrong."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from control.laws.applied import AppliedLaw
from control.laws.force_integral import IntegralState
from control.laws.law import NoSettings, NoState, Seen
from control.laws.shipped import SHIPPED, law_name, shipped_law
from control.laws.state_fields import StateFields
from robot_io.errors import ConfigError
from robot_io.rig.config import ControlConfig
from robot_io.tick import Phase
from tests.safety.fold_bench import FoldBench, pushing, without_contact
from tools.faults.bad_laws import BadLaw, steered_by

STRAIGHT = Seen(15.0, 0.0, True, 0.0, 0.0, 1.0, 0.1, 0.01)
CONTROL = ControlConfig(k_f=0.3, k_y_rad_per_m=0.2)


def law(word: str, **settings: float) -> Any:
    return shipped_law(replace(CONTROL, law=word, law_settings=settings))


def seen(theta_f: float = 0.0, lateral: float = 0.0, **changes: float) -> Seen:
    return replace(STRAIGHT, theta_f_rad=theta_f, lateral_m=lateral, **changes)


def test_the_paper_s_law():
    theta_p, _ = law("force").step(NoState(), seen(0.2, 0.5))
    assert theta_p == pytest.approx(1.3 * 0.2 + 0.2 * 0.5)


@pytest.mark.parametrize("lateral", [0.5, -0.5])
def test_the_line_leads_the_ball_back_whatever_it_feels(lateral):
    theta_p, _ = law("line").step(NoState(), seen(0.7, lateral))
    assert theta_p == pytest.approx(-0.2 * lateral)


def test_open_loop_goes_straight():
    assert law("open-loop").step(NoState(), seen(0.7, 0.5))[0] == 0.0


def test_the_integral_adds_k_i_times_the_offset_over_the_way():
    integral = law("force-integral")
    state = integral.initial()
    for _ in range(1000):  # 1 m at 0.1 m/s, 0.2 m beside the path
        theta_p, state = integral.step(state, seen(0.1, 0.2))
    assert state.integral_rad == pytest.approx(0.06 * 0.2 * 1.0)
    assert theta_p == pytest.approx(1.3 * 0.1 + 0.2 * 0.2 + 0.012)


def test_it_counts_way_not_time():
    integral = law("force-integral", k_i_rad_per_m2=0.1)
    _, slow = integral.step(IntegralState(), seen(0.0, 0.2, speed_m_per_s=0.02, dt_s=0.05))
    _, fast = integral.step(IntegralState(), seen(0.0, 0.2, speed_m_per_s=0.1, dt_s=0.01))
    _, stands = integral.step(IntegralState(), seen(0.0, 0.2, speed_m_per_s=0.0))
    assert slow.integral_rad == pytest.approx(fast.integral_rad) == pytest.approx(0.1 * 0.2 * 0.001)
    assert stands.integral_rad == 0.0


@pytest.mark.parametrize(("progress", "share"), [(0.0, 1.0), (5.9, 1.0), (12.0, 0.5), (24.0, 0.25)])
def test_its_gain_fades_beyond_six_metres(progress, share):
    _, state = law("force-integral").step(IntegralState(), seen(0.0, 0.2, progress_m=progress))
    assert state.integral_rad == pytest.approx(0.06 * 0.2 * 0.001 * share)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_integral_is_bounded_on_both_sides(side):
    integral = law("force-integral", k_i_rad_per_m2=5.0, max_integral_rad=0.4)
    state = IntegralState()
    for _ in range(2000):  # an error of the force's angle of 0.27 rad, to the other side than the offset
        theta_p, state = integral.step(state, seen(-side * 0.27, side * 0.25))
    assert state.integral_rad == side * 0.4
    assert theta_p == pytest.approx(side * (-1.3 * 0.27 + 0.2 * 0.25 + 0.4))


@pytest.mark.parametrize(("lateral", "counted"), [(0.24, 0.24), (0.26, 0.25), (-0.24, -0.24), (-1.0, -0.25)])
def test_of_an_offset_only_a_quarter_of_a_metre_counts(lateral, counted):
    against = -0.2 * lateral / 1.3  # the push is straight all the same
    _, state = law("force-integral").step(IntegralState(), seen(against, lateral))
    assert state.integral_rad == pytest.approx(0.06 * counted * 0.001)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("direction", "share"), [(0.19, 1.0), (0.25, 0.75), (0.3, 0.5), (0.39, 0.05), (0.41, 0.0), (2.0, 0.0)]
)
def test_while_the_push_is_turned_less_is_added_up_or_nothing(side, direction, share):
    """Also what was added up turns the push: 0.1 rad here."""
    force = (side * direction - side * 0.1 - 0.2 * 0.2) / 1.3
    theta_p, state = law("force-integral").step(IntegralState(side * 0.1), seen(force, 0.2))
    assert theta_p == pytest.approx(side * direction, abs=2e-5)
    assert state.integral_rad - side * 0.1 == pytest.approx(0.06 * 0.2 * 0.001 * share)


def test_its_settings_are_checked():
    with pytest.raises(ConfigError, match="`k_j` is not a setting of the law `force-integral`: it has k_i_rad_per_m2"):
        law("force-integral", k_j=1.0)
    with pytest.raises(ConfigError, match=">= 0"):
        law("force-integral", k_i_rad_per_m2=-0.1)
    with pytest.raises(ConfigError, match="it has none"):
        law("force", k_i_rad_per_m2=0.1)


def test_the_names_of_laws():
    assert {word: law_name(word) for word in SHIPPED} == {
        "force": "force feedback", "open-loop": "open loop", "line": "line", "force-integral": "force with integral",
    }  # fmt: skip
    assert law_name("mine:Mine") == "mine:Mine"


# --- states ----------------------------------------------------------------------------------------------------


class Memory(msgspec.Struct, frozen=True):
    angle_rad: float = 0.5
    count: int = 3
    turning: bool = True
    last: tuple[float, int, bool] = (1.5, 2, False)


class Texts(msgspec.Struct, frozen=True):
    word: str = ""


class Endless(msgspec.Struct, frozen=True):
    values: tuple[float, ...] = ()


def test_a_state_goes_into_numbers_and_back():
    fields = StateFields(Memory)
    assert fields.names == ("angle_rad", "count", "turning", "last[0]", "last[1]", "last[2]")
    assert fields.pack(Memory()) == (0.5, 3.0, 1.0, 1.5, 2.0, 0.0)
    back = fields.unpack(fields.pack(Memory(count=2**53, last=(1.5, -2, True))))
    assert back == Memory(count=2**53, last=(1.5, -2, True))
    assert [type(value) for value in msgspec.structs.astuple(back)] == [float, int, bool, tuple]


@pytest.mark.parametrize(
    "state",
    [
        NoState(), None, Memory(angle_rad="x"), Memory(angle_rad=True), Memory(count=0.5), Memory(count=True),
        Memory(count=2**53 + 1), Memory(turning=1), Memory(last=(1.0, 2)), Memory(last=[1.0, 2, True]),
        Memory(last=(1.0, 2.0, True)),
    ],
)  # fmt: skip
def test_a_state_of_another_type_is_refused(state):
    with pytest.raises(TypeError, match="state"):
        StateFields(Memory).pack(state)


@pytest.mark.parametrize("kind", [Texts, Endless])
def test_only_numbers_can_be_kept(kind):
    with pytest.raises(TypeError, match="neither float, int, bool"):
        StateFields(kind)


# --- in a push -------------------------------------------------------------------------------------------------


class Counting(BadLaw):
    """Counts its steps, and holds its course."""

    Settings = NoSettings
    State = Memory

    def initial(self) -> Memory:
        return Memory(count=0)

    def step(self, state: Memory, seen: Seen) -> tuple[float, Memory]:
        return 0.0, replace(state, count=state.count + 1)


def counted(bench: FoldBench) -> int:
    state = bench.state.control.law_state
    return int(state[1]) if state else 0


def counting() -> FoldBench:
    bench = pushing(("control.force_filter_tau_s=0",))
    bench.core = steered_by(Counting())(bench.core)
    return bench


def test_a_law_is_called_once_a_tick_while_the_base_pushes():
    bench = counting()
    for n in range(1, 20):
        bench.fold()
        assert counted(bench) == n


def test_it_is_not_called_while_the_contact_is_lost_and_goes_on_with_its_state():
    bench = counting()
    for _ in range(5):
        bench.fold()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, without_contact)
    before = counted(bench)
    for n in range(10):
        bench.fold(without_contact, n)
    assert counted(bench) == before
    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH)
    assert counted(bench) == before + 1


def test_it_is_not_called_while_the_base_is_held():
    bench = counting()
    bench.fold()

    def held(inp, _n):
        return replace(inp, host=replace(inp.host, launcher_silent_ns=600_000_000))

    bench.fold(held)
    before = counted(bench)
    for _ in range(10):
        bench.fold(held)
    assert counted(bench) == before


class Seeing(BadLaw):
    def __init__(self) -> None:
        self.seen: list[Seen] = []

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        self.seen.append(seen)
        return 0.0, state


def test_what_it_sees_is_in_the_frame_of_the_path():
    one = Seeing()
    applied = AppliedLaw(one)
    bench = pushing(("control.force_filter_tau_s=0",))
    bench.core = replace(bench.core, control=replace(bench.core.control, law=applied))
    bench.force_path = (12.0, 9.0)
    bench.fold()
    bench.fold()
    last = one.seen[-1]
    assert (last.force_along_N, last.force_across_N) == pytest.approx((12.0, 9.0), abs=0.2)
    assert last.theta_f_rad == pytest.approx(math.atan2(9.0, 12.0), abs=0.02)
    assert last.force_valid
    assert last.dt_s == pytest.approx(0.01)
    assert last.speed_m_per_s == pytest.approx(0.1, abs=1e-3)
    control = bench.state.control
    assert (last.lateral_m, last.progress_m) == (control.lateral_m, control.progress_m)


class Addressing(BadLaw):
    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        raise ValueError(f"{object()}\nand more")


@pytest.mark.parametrize("returned", [None, 0.1, (0.1,), (True, NoState()), ("x", NoState()), (0.1, NoState(), 1)])
def test_whatever_it_returns_the_tick_goes_on(returned):
    class Returning(BadLaw):
        def step(self, state: Any, seen: Seen) -> Any:
            return returned

    found = AppliedLaw(Returning()).step((), STRAIGHT)
    assert found.error.startswith("TypeError: ")
    assert found.state == ()


def test_the_words_of_an_error_are_the_same_in_every_run():
    assert AppliedLaw(Addressing()).step((), STRAIGHT).error == "ValueError: <object object at 0x..."
