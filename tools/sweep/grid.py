"""Define simulation studies: the parameters of one case, and grid or Monte Carlo files that give many cases.

A grid file is TOML: `[fixed]` sets parameters for all cases, `[grid]` lists values of which every combination is
run (the last key varies fastest), `[random]` draws `samples` cases uniformly from the two-number `[random.ranges]`.
"""

from __future__ import annotations

import itertools
import logging
import math
import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import msgspec
from msgspec import Meta

from robot_io.errors import ConfigError, UsageError
from robot_io.rig import toml as toml_text
from robot_io.rig.checks import build
from robot_io.rig.toml import Origins
from robot_io.rig.types import Positive, Table
from sim_backend.physics.lanes import Lane, LaneLaw, Timing
from sim_backend.physics.slider import Circle, Rectangle, pressure_distance_m

MOST_CASES = 1_000_000
MOST_STATES = 20_000_000
"""Recorded states of a study: about a gigabyte."""

_NOTES = logging.getLogger(__name__)

Length = Annotated[float, Meta(gt=0, le=1000)]
Position = Annotated[float, Meta(ge=-1000, le=1000)]


class Case(Table, frozen=True):
    """Parameters of one simulated push, as a grid file names them (a `square` has the side `length_m`)."""

    shape: Literal["square", "rectangle", "circle"] = "square"
    length_m: Length = 1.0
    width_m: Length = 1.0
    radius_m: Length = 0.5
    pressure: Literal["uniform", "rim", "point"] = "uniform"
    tau_max_Nm: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Maximum friction torque of the floor; 0: computed from `pressure`."""
    f_max_N: Annotated[float, Meta(gt=0, le=1e6)] = 1.0
    contact_friction: Annotated[float, Meta(ge=0, le=10)] = 0.5
    y0_m: Position = 0.0
    phi0_rad: Annotated[float, Meta(ge=-math.pi, le=math.pi)] = 0.0
    s0_m: Position = 0.0
    k_f: Annotated[float, Meta(ge=0, le=10)] = 0.1
    k_y_rad_per_m: Annotated[float, Meta(ge=0, le=10)] = 0.01
    speed_m_per_s: Annotated[float, Meta(gt=0, le=100)] = 0.1
    law: LaneLaw = "force"
    k_i_rad_per_m2: Annotated[float, Meta(ge=0, le=10)] = 0.06
    """Of the law `force-integral`."""


class TimeTable(Table, frozen=True):
    """Duration of each push, its time step, and the interval between recorded states."""

    dt_s: Positive = 0.01
    duration_s: Positive = 600.0
    record_s: Positive = 10.0


class RandomTable(Table, frozen=True):
    """Monte Carlo: this many cases, each parameter in `ranges` drawn uniformly between its two numbers."""

    samples: Annotated[int, Meta(ge=1, le=MOST_CASES)]
    ranges: dict[str, tuple[float, float]]
    seed: int = 0


class GridFile(Table, frozen=True):
    """The contents of a grid file."""

    name: Annotated[str, Meta(pattern="^[A-Za-z0-9._-]+$")] = "grid"
    fixed: Case = Case()
    grid: dict[str, list[Any]] = msgspec.field(default_factory=dict)
    time: TimeTable = TimeTable()
    random: dict[str, Any] = msgspec.field(default_factory=dict)


class Study(msgspec.Struct, frozen=True):
    """A named list of cases and their common timing."""

    name: str
    cases: tuple[Case, ...]
    timing: Timing


def load_grid(path: Path, changes: Mapping[str, Any], dt_s: float | None = None) -> Study:
    """Read a grid file; `changes` override its `[fixed]` table, and `dt_s` replaces its step.

    Raises ConfigError for an empty grid, or naming the line of the first mistake.
    """
    name = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise ConfigError(f"this grid cannot be read: {why}", where=name, do="Give `paper` or a TOML file") from None
    data, origins = toml_text.parse(text, name)
    _use_todays_names(data, origins, name)
    for word in (changes.get("law"), *_laws(data)):
        check_law(word, name)
    file = build(GridFile, data, origins, name)
    fixed = {**data.get("fixed", {}), **changes}
    ranges = _random_table(file, origins, name)
    drawn = ranges.ranges if ranges else {}
    if clash := sorted(set(changes) & (set(file.grid) | set(drawn))):
        raise ConfigError(
            f"the grid varies {clash[0]}, which the command line fixes", where=name, do="Drop one of them"
        )
    if twice := sorted(set(file.grid) & set(drawn)):
        raise ConfigError(f"[grid] and [random] both vary {twice[0]}", where=name, do="Drop one of them")
    if not file.grid and not drawn:
        raise ConfigError("this grid varies nothing", where=name, do="Add a [grid] or a [random.ranges] table")
    count = math.prod(map(len, file.grid.values())) * (ranges.samples if ranges else 1)
    if count > MOST_CASES:
        raise ConfigError(f"this grid has {count} cases, more than {MOST_CASES}", where=name)
    draws = _draws(ranges)
    combinations = _combinations(file, origins, name)
    cases = tuple(
        msgspec.convert({**fixed, **combination, **draw}, Case) for combination in combinations for draw in draws
    )
    for case in cases:
        lane_of(case)  # report an impossible slider before anything runs
    timing = timing_of(file.time, dt_s, name)
    if len(cases) * timing.records > MOST_STATES:
        raise ConfigError(
            f"this grid would record {len(cases) * timing.records} states, more than {MOST_STATES}",
            where=name,
            do="Raise record_s, or run fewer cases",
        )
    return Study(file.name, cases, timing)


def check_law(law: object, where: str) -> None:
    """Raise UsageError for a law that compiled lanes do not know."""
    if isinstance(law, str) and law not in get_args(LaneLaw):
        raise UsageError(
            f"`push sweep` knows the shipped laws ({', '.join(get_args(LaneLaw))}), not `{law}`",
            where=where,
            do="Use `push study`, which runs any law",
        )


def _laws(data: Mapping[str, Any]) -> list[object]:
    """Return the laws that a grid file names, whatever else is wrong with it."""
    fixed, varied = data.get("fixed"), data.get("grid")
    several = varied.get("law") if isinstance(varied, dict) else None
    one = [fixed.get("law")] if isinstance(fixed, dict) else []
    return [*one, *(several if isinstance(several, list) else [])]


def _use_todays_names(data: dict[str, Any], origins: Origins, name: str) -> None:
    """Read `controller`, which the law was called once, with a note."""
    for table in ("fixed", "grid"):
        held = data.get(table)
        if isinstance(held, dict) and "controller" in held and "law" not in held:
            where = origins.get((table, "controller"), name)
            _NOTES.warning("%s: `controller` is read as `law`, which is its name now", where)
            held["law"] = held.pop("controller")
            origins[table, "law"] = where


def _combinations(file: GridFile, origins: Origins, name: str) -> list[dict[str, Any]]:
    for key, values in file.grid.items():
        where = origins.get(("grid", key), name)
        if not values:
            raise ConfigError(f"the grid gives no values for `{key}`", where=where, do="List at least one")
        for value in values:
            _check_parameter(key, value, where)
    return [dict(zip(file.grid, values, strict=True)) for values in itertools.product(*file.grid.values())]


def _random_table(file: GridFile, origins: Origins, name: str) -> RandomTable | None:
    if not file.random:
        return None
    table = build(RandomTable, file.random, {k[1:]: v for k, v in origins.items() if k[0] == "random"}, name)
    for key, (low, high) in table.ranges.items():
        where = origins.get(("random", "ranges", key), name)
        _check_parameter(key, low, where)
        _check_parameter(key, high, where)
        if low > high:
            raise ConfigError(f"the range of `{key}` ends below its start", where=where)
    return table


def _draws(table: RandomTable | None) -> list[dict[str, Any]]:
    if table is None:
        return [{}]
    rng = random.Random(table.seed)
    return [{key: rng.uniform(*ends) for key, ends in table.ranges.items()} for _ in range(table.samples)]


def _check_parameter(key: str, value: Any, where: str) -> None:
    """Raise ConfigError unless `key = value` is valid in `[fixed]`."""
    build(Case, {key: value}, {(key,): where}, where)


def timing_of(table: TimeTable, dt_s: float | None = None, where: str = "--dt") -> Timing:
    """Return the steps of a time table.

    Raises ConfigError unless the step divides the duration and the recording interval."""
    dt = table.dt_s if dt_s is None else dt_s
    if not (math.isfinite(dt) and dt > 0):
        raise ConfigError(f"a step of {dt} s is not a positive, finite time", where=where)
    counts = [table.duration_s / dt, table.record_s / dt]
    if any(abs(count - round(count)) > 1e-6 or round(count) < 1 for count in counts):
        raise ConfigError(
            f"a step of {dt} s does not divide both the duration {table.duration_s:g} s and the recording interval "
            f"{table.record_s:g} s",
            where=where,
        )
    if counts[0] > 1e8:
        raise ConfigError(f"{counts[0]:.3g} steps per case are too many", where=where, do="Choose a longer step")
    return Timing(dt, round(counts[0]), round(counts[1]))


def lane_of(case: Case) -> Lane:
    """Return the simulation lane of a case. Raises ConfigError for an impossible slider."""
    shape = Circle(case.radius_m) if case.shape == "circle" else Rectangle(case.length_m, _width(case))
    d = case.tau_max_Nm / case.f_max_N if case.tau_max_Nm else pressure_distance_m(shape, case.pressure)
    round_ = case.shape == "circle"
    return Lane(
        round=round_,
        reach_m=case.radius_m if round_ else case.length_m / 2,
        half_width_m=case.radius_m if round_ else _width(case) / 2,
        d_m=d,
        contact_friction=case.contact_friction,
        y0_m=case.y0_m,
        phi0_rad=case.phi0_rad,
        s0_m=case.s0_m,
        k_f=case.k_f,
        k_y_rad_per_m=case.k_y_rad_per_m,
        speed_m_per_s=case.speed_m_per_s,
        f_max_N=case.f_max_N,
        law=case.law,
        k_i_rad_per_m2=case.k_i_rad_per_m2,
    )


def _width(case: Case) -> float:
    return case.length_m if case.shape == "square" else case.width_m


def product(**values: Sequence[Any]) -> list[dict[str, Any]]:
    """Return every combination of the named values, the last name varying fastest."""
    return [dict(zip(values, combination, strict=True)) for combination in itertools.product(*values.values())]
