"""`push tune [RIG]`: gains for the sliders one expects: the stable region, a recommendation and its cost.

The region is the closed form of `sim_backend.physics.gain_limits` over all assumed sliders, those of the rig unless
said otherwise, as they resist turning along the push; beside it stands the ellipsoid's, which is pessimistic. The
sliders that bind it are checked by simulation.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

from control.laws.shipped import is_shipped
from robot_io.error_report import say_json, tell
from robot_io.errors import UsageError
from robot_io.rig.config import RigConfig
from sim_backend.physics.assumed_sliders import AssumedSlider, bodies, pessimistic_bodies, samples
from sim_backend.physics.gain_limits import (
    PushedBody,
    fast_loop_k_f,
    integral_limit,
    limit,
    offset_per_degree_m,
    offset_per_newton_m,
)
from sim_backend.physics.slider import Circle, Pressure, Rectangle
from sim_backend.physics.support import PressureName
from tools.rig import resolve_rig
from tools.sweep.tune_map import PRESETS
from tools.terminal.arguments import named_path, number, pair
from tools.terminal.rig_arguments import add_rig
from tools.terminal.rig_sliders import rig_sliders, sliders_of

Choice = TypeVar("Choice", bound=str)
TUNED = ("force", "force-integral")
SHAPES: tuple[Literal["box", "circle"], ...] = ("box", "circle")
PRESSURES: tuple[PressureName, ...] = ("uniform", "rim", "point", "frame", "corners", "centre")
MAP_K_F = tuple(i / 100 for i in range(2, 61, 2))
_WORLD_OPTIONS = (
    ("ball-radius-m", "M", (0.001, 0.2), "world.ball_radius_m"),
    ("push-height-m", "M", (0, 2), "world.floor.push_height_m"),
    ("floor-friction", "MU", (0.001, 2), "world.slider.floor_friction"),
    ("anisotropy", "RATIO", (0.5, 2), "world.floor.along_over_across"),
)
"""Name, metavar, range and key of the rig's values that have an option of their own."""
SHARE = 0.5
"""The recommended k_y is this share of its limit: twice the gain is still stable."""
LENGTHS_M = pair(0.01, 10, "LOW,HIGH", rising=True)
"""The range of a slider's lengths."""
CHECK_TOLERANCE = 0.01
"""Largest relative difference between the limits by simulation and by the closed form."""
MAX_K_F_SHARE = 0.5
"""The recommended k_f stays below this share of the k_f at which the force angle itself becomes unstable."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    add_rig(parser)
    parser.add_argument("--law", default="force", metavar="LAW", help="force (default) or force-integral")
    parser.add_argument("--shapes", help="box, circle or both (default: box,circle)")
    parser.add_argument(
        "--size-m", type=LENGTHS_M, metavar="LOW,HIGH", help="length along the push, or diameter (default: [sliders])"
    )
    parser.add_argument(
        "--width-m", type=LENGTHS_M, metavar="LOW,HIGH", help="width of a box across the push (default: its length)"
    )
    parser.add_argument("--pressures", help=f"any of {', '.join(PRESSURES)} (default: that of [sliders])")
    for option, metavar, most, key in _WORLD_OPTIONS:
        parser.add_argument(f"--{option}", type=number(*most), metavar=metavar, help=f"instead of {key} of the rig")
    parser.add_argument(
        "--slide-force-N", type=number(0.1, 300), default=15.0, metavar="N", help="force that keeps a slider moving"
    )
    parser.add_argument(
        "--k-f", type=number(1e-6, 2), metavar="K_F", help="k_f to recommend a k_y for (default: the rig's)"
    )
    parser.add_argument("--out", type=named_path, metavar="DIR", help="folder for the map (default: sweeps/tune-TIME)")
    parser.add_argument("--no-check", action="store_true", help="skip the simulations")
    parser.add_argument("--json", action="store_true", help="the result as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Find gains and print them; return the exit code. Raises UsageError, and ConfigError of the rig."""
    check_law(args.law)
    rig = rig_of(args)
    sliders = sliders_assumed(args, rig)
    judged, pessimistic = bodies(sliders), pessimistic_bodies(sliders)
    fast, asked = fast_loop_k_f(judged), rig.control.k_f if args.k_f is None else args.k_f
    k_f = asked if asked <= MAX_K_F_SHARE * fast else _rounded_down(max(MAX_K_F_SHARE * fast, 1e-9))
    highest = limit(judged, k_f)
    if highest <= 0:
        raise UsageError(
            f"no k_y is stable for all these sliders at k_f = {k_f:.3g}",
            do="Raise --k-f, or narrow the ranges of the sliders",
        )
    k_y = _rounded_down(SHARE * highest)
    out = _folder(args.out)
    with _removed_if_left_empty(out):
        from tools.sweep.limit_checks import check_integral_limits, check_limits

        checks = [] if args.no_check else check_limits(sliders, k_f)
        integral = _integral(judged, k_f, k_y) if args.law == "force-integral" else None
        if integral and not args.no_check:
            checks += check_integral_limits(sliders, k_f, k_y)
        files = _draw(judged, pessimistic, (k_f, k_y), f"{len(sliders)} sliders of {rig.name}", out)
    gains = {f"rig {rig.name}": (rig.control.k_f, rig.control.k_y_rad_per_m), **PRESETS}
    result: dict[str, Any] = {
        "law": args.law,
        "rig": rig.name,
        "integral": integral,
        "assumed": len(sliders),
        "recommended": {"k_f": k_f, "k_y_rad_per_m": k_y},
        "limit_k_y_rad_per_m": highest,
        "share_of_limit": k_y / highest,
        "margin": highest / k_y,
        "pessimistic_limit_k_y_rad_per_m": max(limit(pessimistic, k_f), 0.0),
        "fast_loop_k_f": fast,
        "pessimistic_fast_loop_k_f": fast_loop_k_f(pessimistic),
        "offset_m_per_degree": offset_per_degree_m(k_f, k_y),
        "offset_m_per_newton": offset_per_newton_m(k_f, k_y, args.slide_force_N),
        "limits": [
            {"k_f": f, "k_y_rad_per_m": limit(judged, f), "pessimistic_k_y_rad_per_m": limit(pessimistic, f)}
            for f in MAP_K_F
        ],
        "presets": [_preset(name, *pair, judged, pessimistic) for name, pair in gains.items()],
        "checks": checks,
        "checks_within": CHECK_TOLERANCE,
        "checks_passed": all(abs(entry["difference"]) <= CHECK_TOLERANCE for entry in checks) if checks else None,
        "out": str(out),
        "files": files,
    }
    _print_result(result, asked, args.slide_force_N)
    if args.json:
        say_json({"schema": 1, **result})
    return 0


def _preset(
    name: str, k_f: float, k_y: float, judged: Sequence[PushedBody], pessimistic: Sequence[PushedBody]
) -> dict[str, Any]:
    shares = [k_y / top if (top := limit(some, k_f)) > 0 else None for some in (judged, pessimistic)]
    gains = {"name": name, "k_f": k_f, "k_y_rad_per_m": k_y}
    return {**gains, "share_of_limit": shares[0], "share_of_pessimistic_limit": shares[1]}


def check_law(law: str) -> None:
    """Raise UsageError for a law whose gains have no limits in closed form."""
    if law in TUNED:
        return
    if is_shipped(law):
        raise UsageError(f"the law `{law}` does not feel the force: no gain of it keeps an object", where="--law")
    raise UsageError(
        f"`push tune` has limits for {' and '.join(TUNED)} only, not for `{law}`",
        where="--law",
        do="Use `push study`, which runs any law",
    )


def _integral(bodies: Sequence[PushedBody], k_f: float, k_y: float) -> dict[str, float]:
    """Return a gain of the integral beside these gains, and its limit."""
    highest = integral_limit(bodies, k_f, k_y)
    return {"k_i_rad_per_m2": _rounded_down(SHARE * highest), "limit_k_i_rad_per_m2": highest}


def rig_of(args: argparse.Namespace) -> RigConfig:
    """Return the rig with the options that stand for values of it. Raises ConfigError and UsageError of the rig."""
    given = [(key, getattr(args, option.replace("-", "_"))) for option, _, _, key in _WORLD_OPTIONS]
    return resolve_rig(args.rig, [*args.overrides, *(f"{key}={value}" for key, value in given if value is not None)])


def sliders_assumed(args: argparse.Namespace, rig: RigConfig) -> list[AssumedSlider]:
    """Return the rig's sliders, or those that the arguments describe. Raises UsageError where all of them tip over."""
    sizes = args.size_m or (rig.sliders.shortest_m, rig.sliders.longest_m)
    shapes = _choices(args.shapes, SHAPES, "--shapes") if args.shapes is not None else list(SHAPES)
    if args.pressures is not None:
        pressures: list[Pressure] = list(_choices(args.pressures, PRESSURES, "--pressures"))
    else:
        pressures = [rig.sliders.pressure]
    if all(given is None for given in (args.shapes, args.size_m, args.width_m, args.pressures)):
        sliders = rig_sliders(rig)
    else:
        lengths, widths = samples(*sizes), samples(*args.width_m) if args.width_m else None
        outlines: list[Circle | Rectangle] = []
        for length in lengths:
            outlines += [Rectangle(length, width) for width in widths or [length]] if "box" in shapes else []
            outlines += [Circle(length / 2)] if "circle" in shapes else []
        sliders = sliders_of(rig, outlines, pressures)
    if not sliders:
        raise UsageError("all these sliders would tip over", do="Lower --push-height-m or --floor-friction")
    return sliders


def _print_result(result: dict[str, Any], asked_k_f: float, slide_force_N: float) -> None:
    best = result["recommended"]
    tell(
        f"recommended: k_f {best['k_f']:.3g}, k_y {best['k_y_rad_per_m']:.3g} rad/m, a margin of "
        f"{result['margin']:.2g} to the limit {result['limit_k_y_rad_per_m']:.3g} rad/m over {result['assumed']} "
        "assumed sliders"
    )
    low = result["pessimistic_limit_k_y_rad_per_m"]
    bound = f"is {low:.3g} rad/m" if low > 0 else "allows no k_y"
    tell(f"  the pessimistic limit {bound}: as if they resisted turning as on the spot (the ellipsoid)")
    if result["integral"]:
        tell(
            "  with these the integral's k_i {k_i_rad_per_m2:.2g} rad/m^2, half of its limit "
            "{limit_k_i_rad_per_m2:.2g}; it takes the steady offset away".format(**result["integral"])
        )
    if best["k_f"] < asked_k_f:
        tell(
            f"  k_f {asked_k_f:g} is not used: beyond {result['fast_loop_k_f']:.3g} the force's direction is unstable "
            f"for some slider, and the recommended k_f stays below {MAX_K_F_SHARE:g} of that"
        )
    tell(
        f"what it costs: {result['offset_m_per_degree']:.2g} m of steady offset for each degree of error in the "
        f"force's direction, {result['offset_m_per_newton']:.2g} m for each newton of bias at {slide_force_N:g} N"
    )
    tell("k_y as a share of its limit (1 is the edge of stability):")
    for preset in result["presets"]:
        shares = preset["share_of_limit"], preset["share_of_pessimistic_limit"]
        judged, low = ("none is stable" if share is None else f"{share:.2f}" for share in shares)
        tell(f"  {preset['name']} {preset['k_f']:g}/{preset['k_y_rad_per_m']:g}: {judged}, pessimistic {low}")
    for entry in result["checks"]:
        gain = "k_y" if "simulated_k_y" in entry else "k_i"
        tell(
            f"  simulated: {entry['shape']} {entry['contact']}, limit {entry[f'simulated_{gain}']:.4g} "
            f"(closed form {entry[f'closed_form_{gain}']:.4g}, {100 * entry['difference']:+.2f} %)"
        )
    tell(f"map in {result['out']}: {', '.join(result['files'])}")


def _draw(
    judged: Sequence[PushedBody],
    pessimistic: Sequence[PushedBody],
    recommended: tuple[float, float],
    what: str,
    out: Path,
) -> list[str]:
    from tools.sweep.figures import save
    from tools.sweep.tune_map import draw

    curves = []
    for some in (judged, pessimistic):
        fast = fast_loop_k_f(some)  # the limit drops to zero here, without a slope
        k_f = sorted((*MAP_K_F, *((math.nextafter(fast, 0.0), fast) if MAP_K_F[0] < fast < MAP_K_F[-1] else ())))
        curves.append([(f, limit(some, f)) for f in k_f])
    return save(draw(curves[0], curves[1], recommended, what), out, "gain_map")


def _folder(out: Path | None) -> Path:
    folder = out or Path("sweeps") / f"tune-{time.strftime('%Y%m%d-%H%M%S')}"
    try:
        if folder.exists() and any(folder.iterdir()):
            raise UsageError("this folder is not empty", where=str(folder), do="Give another --out")
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"this folder cannot be written: {error.strerror}", where=str(folder), do="Give another --out"
        ) from None
    return folder


@contextlib.contextmanager
def _removed_if_left_empty(folder: Path) -> Iterator[None]:
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # there is something in it, as there should be
            folder.rmdir()


def _choices(text: str, known: tuple[Choice, ...], where: str) -> list[Choice]:
    by_name = {str(word): word for word in known}
    for word in text.split(","):
        if word not in by_name:
            raise UsageError(f"`{word}` is not one of {', '.join(known)}", where=where)
    return [by_name[word] for word in text.split(",")]


def _rounded_down(value: float) -> float:
    """Return a value rounded down to two digits, so that it reads well and keeps its margin."""
    scale = 10.0 ** (1 - math.floor(math.log10(value)))
    return math.floor(value * scale + 1e-9) / scale
