"""The picture of `push watch` as lines of text, for any width; and as one line. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

from safety.faults import FAULTS
from tools.watch.ball_force import BallForce, direction, drawing
from tools.watch.seen import DEVICES, Link, Stage
from tools.watch.view import ArmView, BaseView, Feed, View

DRAWN_FROM = 70
"""The drawing stands beside the numbers from this many columns on."""
DRAWING_ROWS = 7
FROM_ABOVE = "from above, forward is up"
HOLDING = "holding"
NOTHING_YET = "no reading of the sensor yet"


class Line(NamedTuple):
    """A line and its style: "", "title", "sign", "bad" or "faint"."""

    text: str
    style: str = ""


def picture(view: View, columns: int, *, unicode: bool) -> list[Line]:
    """Return the lines of the picture, none longer than `columns`."""
    lines = [Line(f"push watch {view.rig}: {view.source}", "title")]
    if view.stage is not None:
        lines.append(Line(_run(view.stage)))
        lines += [Line(f"{fault} {FAULTS[fault].text}", "bad") for fault in view.stage.faults if fault in FAULTS]
    lines += [Line(""), *_force(view, columns, unicode=unicode), Line("")]
    for device in DEVICES:
        lines += _wrapped(device, _facts(view, device), columns, _trouble(view, device))
    keys = "q ends" if view.stage is not None else "q ends   t tares again"
    lines += [Line(""), Line(keys, "faint")]
    return [Line(text[:columns], style) for text, style in lines]


def one_line(view: View) -> str:
    """Return the picture as one line, for where there is no terminal."""
    parts = [_run(view.stage)] if view.stage is not None else []
    if view.force is None:
        parts.append(view.tare or NOTHING_YET)
    else:
        axes = direction(view.force.body).axes
        parts += [_said(view.force), f"BODY {_numbers(view.force.body)} N{f' ({axes})' if axes else ''}"]
        parts += [f"PATH {_numbers(view.force.path)} N"] if view.force.path is not None else []
        parts.append(_theta(view.force))
    parts.append(_offset(view))
    parts += [f"{device}: {', '.join(_facts(view, device))}" for device in DEVICES]
    return "  ".join(" ".join(part.split()) for part in parts)


def _run(stage: Stage) -> str:
    return f"run: {stage.phase} {stage.mode}  {stage.progress_m:.2f} m"


def _force(view: View, columns: int, *, unicode: bool) -> list[Line]:
    force = view.force
    if force is None:
        return [_bar(view.tare or NOTHING_YET, columns), *[Line("")] * DRAWING_ROWS]
    towards = direction(force.body)
    arrow = towards.arrow if unicode else towards.ascii_arrow
    axes = f"  ({towards.axes} BODY)" if towards.axes else ""
    sign = f"{arrow}  {_said(force)}{axes}"
    path = f"PATH   {_numbers(force.path)} N" if force.path is not None else "PATH   the heading is not known"
    rows = [
        f"on ball{'x':>8}{'y':>9}{'z':>9}",
        f"SENSOR {_numbers(force.sensor)} N",
        f"BODY   {_numbers(force.body)} N",
        path,
        _theta(force),
        _offset(view),
        view.tare,
    ]
    if columns < DRAWN_FROM:
        return [_bar(sign, columns), *map(Line, rows)]
    shape = drawing(force.body, rows=DRAWING_ROWS, unicode=unicode)
    beside = [f"{row:<42}{drawn}".rstrip() for row, drawn in zip(rows, shape, strict=True)]
    return [_bar(f"{sign:<42}{FROM_ABOVE}", columns), *map(Line, beside)]


def _bar(text: str, columns: int) -> Line:
    """Return a line that is as wide as the screen; the last column stays free, or the terminal would wrap."""
    return Line(f"{text:<{max(0, columns - 1)}}", "sign")


def _said(force: BallForce) -> str:
    x, y, z = force.body
    return f"{direction(force.body).words}  {math.sqrt(x * x + y * y + z * z):.1f} N"


def _numbers(force: tuple[float, float, float]) -> str:
    return "".join(f"{value:+9.2f}" for value in force)[1:]


def _theta(force: BallForce) -> str:
    if force.theta_f_rad is None:
        return "theta_f     -"
    return f"theta_f {math.degrees(force.theta_f_rad):+6.1f} deg (force on the object)"


def _offset(view: View) -> str:
    if view.lateral_m is None:
        return "y_c         -"
    side = "left" if view.lateral_m > 0.0 else "right"
    return f"y_c     {view.lateral_m:+6.3f} m ({side} of the path)"


def _trouble(view: View, device: str) -> bool:
    """Return whether something about a device is not as a push needs it."""
    names = {"ft": ("ft",), "arm": ("arm",), "base": ("pose", "odometry")}[device]
    if view.links[device].state != "up" or any(view.feeds[name].late for name in names):
        return True
    if device == "arm":
        return view.arm is None or not view.arm.held or view.arm.state != HOLDING
    if device == "base":
        return bool(view.base.pose_flaw or view.base.stop_engaged or view.base.drivers_active is False)
    return False


def _facts(view: View, device: str) -> list[str]:
    link = view.links[device]
    if link.state != "up":
        return [f"{link.state.upper()}: {link.cause}" if link.cause else link.state.upper()]
    if device == "ft":
        return _link_facts(link, [_age("", view.feeds["ft"])])
    if device == "arm":
        return _link_facts(link, [_age("", view.feeds["arm"]), *_arm_facts(view.arm)])
    feeds = [_age("pose ", view.feeds["pose"]), _age("odometry ", view.feeds["odometry"])]
    return _link_facts(link, [*feeds, *_base_facts(view.base)])


def _link_facts(link: Link, facts: list[str]) -> list[str]:
    return [*([link.cause] if link.cause else []), *facts]


def _age(name: str, feed: Feed) -> str:
    if feed.age_ms is None:
        return f"{name}nothing yet"
    rate = f"{feed.rate_hz:.0f} Hz, " if feed.rate_hz is not None else ""
    age = f"{feed.age_ms:.0f} ms" if feed.age_ms < 10_000.0 else f"{feed.age_ms / 1000.0:.0f} s"
    return f"{name}OLD, {age}" if feed.late else f"{name}{rate}{age} old"


def _arm_facts(arm: ArmView | None) -> list[str]:
    if arm is None:
        return []
    off = f"{arm.off_held_rad:+.3f} rad ({arm.worst_joint})"
    return [arm.state, f"at the held pose, {off}" if arm.held else f"OFF THE HELD POSE, {off}"]


def _base_facts(base: BaseView) -> list[str]:
    facts = []
    if base.pose_flaw:
        facts.append(f"pose unusable: {base.pose_flaw}")
    elif base.pose is not None:
        x, y, yaw = base.pose
        facts.append(f"x {x:+.3f} m, y {y:+.3f} m, yaw {math.degrees(yaw):+.1f} deg")
    if base.twist is not None:
        vx, vy, omega = base.twist
        facts.append(f"{math.hypot(vx, vy):.3f} m/s, {math.degrees(omega):+.1f} deg/s")
    if base.stop_engaged is not None:
        motors = "motors on" if base.drivers_active else "motors off"
        facts.append(f"{'STOP PRESSED' if base.stop_engaged else 'no stop'}, {motors}, {base.battery_v:.1f} V")
    return facts


def _wrapped(device: str, facts: list[str], columns: int, trouble: bool) -> list[Line]:
    """Return the facts of a device in as many lines as they need; only one that is too long is broken."""
    style = "bad" if trouble else ""
    lines, text = list[str](), f"{device:<5}"
    for fact in facts:
        piece = fact if text.strip() in ("", device) else f"; {fact}"
        if len(text) + len(piece) >= columns and text.strip() not in ("", device):
            lines.append(f"{text};")
            text, piece = " " * 5, fact
        while len(text) + len(piece) > columns:
            cut = piece.rfind(" ", 1, max(2, columns - len(text)))
            cut = cut if cut > 0 else max(1, columns - len(text))
            lines.append(text + piece[:cut])
            text, piece = " " * 5, piece[cut:].lstrip()
        text += piece
    return [Line(line, style) for line in (*lines, text)]
