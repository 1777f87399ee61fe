"""A figure as SVG: for a page, with colours that follow the reader's light or dark, or as a file of its own."""

from __future__ import annotations

import html
import io
import re
from typing import TYPE_CHECKING

from tools.report.drawing.style import DARK, PLAN, TIME, lay_out

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}
_PALETTE = {colour.lower(): f"var(--c{colour[1:].lower()}, {colour.lower()})" for colour in DARK}
_LEGEND = re.compile(r'<g id="legend_\d+">')
_ID = re.compile(r' id="([^"]*)"')


def svg(figure: Figure) -> str:
    """Return a figure as a complete SVG file."""
    lay_out(figure)
    target = io.StringIO()
    figure.savefig(target, format="svg", transparent=True, metadata=_NO_METADATA)
    return target.getvalue()


def inline_svg(figure: Figure, name: str, alt: str) -> str:
    """Return a figure as an element of a page. `name` is unique on the page; `alt` says in words what is seen.

    Attributes `data-time` and `data-plan` hold, for each axes of the kind, where it is (left, top, right, bottom, in
    units of the figure) and what it spans (time in s; along and left of the path in m).
    """
    text = svg(figure)
    text = text[text.index("<svg") :]
    head, body = text[: text.index(">") + 1], text[text.index(">") + 1 :]
    view = re.search(r'viewBox="([^"]*)"', head)
    assert view is not None
    marks = "".join(f' data-{kind}="{found}"' for kind in (TIME, PLAN) if (found := _axes(figure, kind)))
    body = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", body, count=1, flags=re.S)
    body = _own_ids(_LEGEND.sub('<g class="legend">', body), name)
    body = re.sub(r"#[0-9a-f]{6}\b", lambda found: _PALETTE.get(found[0], found[0]), body)
    label = html.escape(alt, quote=True)
    return f'<svg viewBox="{view[1]}" role="img" aria-label="{label}" data-name="{name}"{marks}>{body}'


def dark_colours() -> str:
    """Return the CSS variables that `inline_svg` uses, as they are on a dark page."""
    return " ".join(f"--c{light[1:].lower()}: {dark};" for light, dark in DARK.items())


def _own_ids(body: str, name: str) -> str:
    """Return the elements with ids that no other figure has, and without those that nothing refers to."""
    used = set(re.findall(r'(?:url\(|href=")#([^")]*)', body))
    body = _ID.sub(lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", body)
    return re.sub(r'(url\(|href=")#', rf"\1#{name}-", body)


def _axes(figure: Figure, kind: str) -> str:
    width, height = figure.get_size_inches() * 72.0
    found = []
    for axes in figure.axes:
        if axes.get_gid() == kind:
            at = axes.get_position()
            numbers = [at.x0 * width, (1.0 - at.y1) * height, at.x1 * width, (1.0 - at.y0) * height, *axes.get_xlim()]
            numbers += axes.get_ylim() if kind == PLAN else ()
            found.append(",".join(f"{number:.6g}" for number in numbers))
    return ";".join(found)
