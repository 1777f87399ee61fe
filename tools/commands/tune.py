"""`push tune`: gains for the sliders one expects: the stable region, a recommendation and its cost.

The region is the closed form of `sim_backend.physics.gain_limits` over all assumed sliders; the sliders that bind it
are checked by simulation.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

from control.laws.shipped import is_shipped
from robot_io.error_report import say_json, tell
from robot_io.errors import UsageError
from sim_backend.physics.assumed_sliders import pushed_body, samples
from sim_backend.physics.floor import FloorEffects
from sim_backend.physics.gain_limits import (
    PushedBody,
    fast_loop_k_f,
    integral_limit,
    limit,
    offset_per_degree_m,
    offset_per_newton_m,
)
from sim_backend.physics.slider import Circle, Rectangle
from sim_backend.physics.support import PressureName
from tools.sweep.tune_map import PRESETS
from tools.terminal.arguments import named_path, number, pair

Choice = TypeVar("Choice", bound=str)
TUNED = ("force", "force-integral")
SHAPES: tuple[Literal["box", "circle"], ...] = ("box", "circle")
PRESSURES: tuple[PressureName, ...] = ("uniform", "rim", "point")
MAP_K_F = tuple(i / 100 for i in range(2, 61, 2))
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
    parser.add_argument("--law", default="force", metavar="LAW", help="force (default) or force-integral")
    parser.add_argument("--shapes", default="box,circle", help="box, circle or both (default: box,circle)")
    parser.add_argument(
        "--size-m", type=LENGTHS_M, default="0.3,0.7", metavar="LOW,HIGH", help="length along the push, or diameter"
    )
    parser.add_argument(
        "--width-m", type=LENGTHS_M, metavar="LOW,HIGH", help="width of a box across the push (default: its length)"
    )
    parser.add_argument("--pressures", default="uniform,rim", help="any of uniform, rim, point (default: uniform,rim)")
    parser.add_argument(
        "--turning", choices=("ellipsoid", "along-push"), default="ellipsoid",
        help="what resists turning: the ellipsoid (default, cautious), or the pressure along the push",
    )  # fmt: skip
    parser.add_argument(
        "--ball-radius-m", type=number(0, 0.2), default=0.05, metavar="M", help="radius of the contact ball"
    )
    parser.add_argument(
        "--push-height-m", type=number(0, 2), default=0.15, metavar="M", help="height of the push above the floor"
    )
    parser.add_argument("--floor-friction", type=number(0, 2), default=0.3, metavar="MU", help="friction of the floor")
    parser.add_argument(
        "--anisotropy",
        type=number(0.5, 2),
        default=1.0,
        metavar="RATIO",
        help="floor friction along the path divided by that across it",
    )
    parser.add_argument(
        "--slide-force-N", type=number(0.1, 300), default=15.0, metavar="N", help="force that keeps a slider moving"
    )
    parser.add_argument(
        "--k-f", type=number(1e-6, 2), default=0.3, metavar="K_F", help="k_f to recommend a k_y for (default: 0.3)"
    )
    parser.add_argument("--out", type=named_path, metavar="DIR", help="folder for the map (default: sweeps/tune-TIME)")
    parser.add_argument("--no-check", action="store_true", help="skip the simulations")
    parser.add_argument("--json", action="store_true", help="the result as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Find gains and print them; return the exit code. Raises UsageError."""
    check_law(args.law)
    bodies = assumed_bodies(args)
    fast = fast_loop_k_f(bodies)
    k_f = args.k_f if args.k_f <= MAX_K_F_SHARE * fast else _rounded_down(max(MAX_K_F_SHARE * fast, 1e-9))
    highest = limit(bodies, k_f)
    if highest <= 0:
        raise UsageError(
            f"no k_y is stable for all these sliders at k_f = {k_f:.3g}",
            do="Raise --k-f, or narrow the ranges of the sliders",
        )
    k_y = _rounded_down(SHARE * highest)
    out = _folder(args.out)
    from tools.sweep.limit_checks import check_integral_limits, check_limits

    checks = [] if args.no_check else check_limits(bodies, k_f)
    integral = _integral(bodies, k_f, k_y) if args.law == "force-integral" else None
    if integral and not args.no_check:
        checks += check_integral_limits(bodies, k_f, k_y)
    size = "{:g} to {:g} m".format(*args.size_m)
    what = f"{args.shapes} of {size}, pressure {args.pressures}, ball {args.ball_radius_m:g} m"
    files = _draw(bodies, (k_f, k_y), what, out)
    result: dict[str, Any] = {
        "law": args.law,
        "integral": integral,
        "assumed": len(bodies),
        "recommended": {"k_f": k_f, "k_y_rad_per_m": k_y},
        "limit_k_y_rad_per_m": highest,
        "share_of_limit": k_y / highest,
        "margin": highest / k_y,
        "fast_loop_k_f": fast,
        "offset_m_per_degree": offset_per_degree_m(k_f, k_y),
        "offset_m_per_newton": offset_per_newton_m(k_f, k_y, args.slide_force_N),
        "limits": [{"k_f": f, "k_y_rad_per_m": limit(bodies, f)} for f in MAP_K_F],
        "presets": [
            {
                "name": name,
                "k_f": f,
                "k_y_rad_per_m": y,
                "share_of_limit": y / top if (top := limit(bodies, f)) > 0 else None,
            }
            for name, (f, y) in PRESETS.items()
        ],
        "checks": checks,
        "checks_within": CHECK_TOLERANCE,
        "checks_passed": all(abs(entry["difference"]) <= CHECK_TOLERANCE for entry in checks) if checks else None,
        "out": str(out),
        "files": files,
    }
    _print_result(result, args)
    if args.json:
        say_json({"schema": 1, **result})
    return 0


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


def assumed_bodies(args: argparse.Namespace) -> list[PushedBody]:
    """Return the sliders the arguments assume: the ends of their ranges and some between. Raises UsageError."""
    lengths = samples(*args.size_m)
    widths = samples(*args.width_m) if args.width_m else None
    shapes = _choices(args.shapes, SHAPES, "--shapes")
    pressures = _choices(args.pressures, PRESSURES, "--pressures")
    effects = FloorEffects(
        shift_m=args.floor_friction * args.push_height_m, turning=args.turning, along_over_across=args.anisotropy
    )
    bodies = []
    for length in lengths:
        outlines: list[Circle | Rectangle] = []
        if "box" in shapes:
            outlines += [Rectangle(length, width) for width in widths or [length]]
        outlines += [Circle(length / 2)] if "circle" in shapes else []
        bodies += [
            pushed_body(outline, pressure, effects, args.ball_radius_m)
            for outline in outlines
            for pressure in pressures
        ]
    return bodies


def _print_result(result: dict[str, Any], args: argparse.Namespace) -> None:
    best = result["recommended"]
    tell(
        f"recommended: k_f {best['k_f']:.3g}, k_y {best['k_y_rad_per_m']:.3g} rad/m, a margin of "
        f"{result['margin']:.2g} to the limit {result['limit_k_y_rad_per_m']:.3g} rad/m over {result['assumed']} "
        "assumed sliders"
    )
    if result["integral"]:
        tell(
            "  with these the integral's k_i {k_i_rad_per_m2:.2g} rad/m^2, half of its limit "
            "{limit_k_i_rad_per_m2:.2g}; it takes the steady offset away".format(**result["integral"])
        )
    if best["k_f"] < args.k_f:
        tell(
            f"  k_f {args.k_f:g} is not used: beyond {result['fast_loop_k_f']:.3g} the force's direction is unstable "
            f"for some slider, and the recommended k_f stays below {MAX_K_F_SHARE:g} of that"
        )
    tell(
        f"what it costs: {result['offset_m_per_degree']:.2g} m of steady offset for each degree of error in the "
        f"force's direction, {result['offset_m_per_newton']:.2g} m for each newton of bias at {args.slide_force_N:g} N"
    )
    for preset in result["presets"]:
        share = preset["share_of_limit"]
        margin = "no k_y is stable at this k_f" if share is None else f"{share:.2f} of the limit"
        tell(f"  {preset['name']} {preset['k_f']:g}/{preset['k_y_rad_per_m']:g}: {margin}")
    for entry in result["checks"]:
        gain = "k_y" if "simulated_k_y" in entry else "k_i"
        tell(
            f"  simulated: {entry['shape']} {entry['contact']}, limit {entry[f'simulated_{gain}']:.4g} "
            f"(closed form {entry[f'closed_form_{gain}']:.4g}, {100 * entry['difference']:+.2f} %)"
        )
    tell(f"map in {result['out']}: {', '.join(result['files'])}")


def _draw(bodies: Sequence[PushedBody], recommended: tuple[float, float], what: str, out: Path) -> list[str]:
    from tools.sweep.figures import save
    from tools.sweep.tune_map import draw

    fast = fast_loop_k_f(bodies)  # the limit drops to zero here, without a slope
    k_f = sorted((*MAP_K_F, *((math.nextafter(fast, 0.0), fast) if MAP_K_F[0] < fast < MAP_K_F[-1] else ())))
    return save(draw([(f, limit(bodies, f)) for f in k_f], recommended, what), out, "gain_map")


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
