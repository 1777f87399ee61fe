"""Parts of a page: escaped text, tables, and the head that lets a browser fetch nothing and run one script."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Sequence
from pathlib import Path

from tools.report.drawing.svg import dark_colours

CSS = Path(__file__).with_name("page.css")


def escaped(text: str) -> str:
    """Escape text of unknown origin: unprintable characters become blanks, and long text is cut."""
    shown = "".join(letter if letter.isprintable() else " " for letter in text[:2000])
    return html.escape(re.sub(" {2,}", " ", shown), quote=True)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 0, *, stacked: bool = False) -> str:
    """Return an HTML table, "" without rows; the last `numbers` columns are right-aligned.

    stacked: on a phone each row becomes a list, its cells below each other with the heads beside them.
    """
    if not rows:
        return ""
    classes = [' class="n"' if i >= len(heads) - numbers else "" for i in range(len(heads))]
    names = [f' data-head="{escaped(head)}"' if stacked and head else "" for head in heads]
    lines = [f'<div class="wide{" stacked" if stacked else ""}"><table>']
    if any(heads):
        cells = "".join(f"<th{c}>{escaped(head)}</th>" for c, head in zip(classes, heads, strict=True))
        lines.append(f"<tr>{cells}</tr>")
    for row in rows:
        cells = "".join(f"<td{c}{n}>{escaped(cell)}</td>" for c, n, cell in zip(classes, names, row, strict=True))
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join([*lines, "</table></div>"])


def figure(svg: str, caption: str, kind: str = "") -> str:
    """Return an SVG element with the caption below it. `kind`: a class of the style sheet."""
    return f'<figure class="{kind}">{svg}<figcaption>{escaped(caption)}</figcaption></figure>'


def items(lines: Sequence[str]) -> str:
    """Return a list of sentences; what stands between backticks is code."""
    texts = (re.sub("`([^`]+)`", r"<code>\1</code>", escaped(line)) for line in lines)
    return "<ul>\n" + "\n".join(f"<li>{text}</li>" for text in texts) + "\n</ul>" if lines else ""


def style_sheet() -> str:
    """Return the style sheet, with the figures' colours on a dark page."""
    return CSS.read_text(encoding="utf-8").replace("/* dark colours of the figures */", dark_colours())


def content_policy(script: str = "") -> str:
    """Return the Content-Security-Policy of a page: nothing is fetched, and no other script than this one runs."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    scripts = f" script-src 'sha256-{digest}';" if script else ""
    return f"default-src 'none'; style-src 'unsafe-inline';{scripts} base-uri 'none'; form-action 'none'"
