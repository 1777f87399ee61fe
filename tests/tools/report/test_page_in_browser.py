"""The page of a run in a browser: it opens, plays and scrubs, without a word on the console and without a request."""

import re

import pytest

from tests.browser import browser
from tools.cli import main

pytestmark = pytest.mark.browser
CURSORS = "[...document.querySelectorAll('line.cursor')].map(l => l.getAttribute('x1')).join()"
TIME_S = "parseFloat(document.getElementById('at-time').textContent)"


@pytest.fixture(scope="module")
def report(runs, tmp_path_factory):
    out = tmp_path_factory.mktemp("page")
    assert main(["report", str(runs / "one"), "--out", str(out)]) == 0
    return out / "report.html"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser")) as page:
        yield page


@pytest.fixture(autouse=True)
def no_word_on_the_console(page):
    yield
    assert page.problems == []


def test_it_opens_with_the_player_at_first_contact(page, report):
    page.open(report)
    assert page.value("document.getElementById('player').hidden") is False
    assert page.value("document.getElementById('at-phase').textContent") == "push"
    assert page.value("document.getElementById('at-along').textContent") in ("0.00 m", "-0.00 m", "0.01 m")
    assert page.value("document.querySelectorAll('line.cursor').length") == 8
    assert page.value("document.querySelector('#stage .object').getAttribute('points').split(' ').length") == 5


def test_it_plays_to_the_end_and_moves_everything(page, report):
    page.open(report)
    cursors, ball = page.value(CURSORS), page.value("document.querySelector('#stage .ball').getAttribute('cx')")
    page.value("document.getElementById('speed').value = '16'; document.getElementById('play').click()")
    page.wait_for("document.getElementById('time').value === document.getElementById('time').max")
    page.wait_for("document.getElementById('play').textContent === 'Play'")
    assert page.value(CURSORS) != cursors
    assert page.value("document.querySelector('#stage .ball').getAttribute('cx')") != ball
    assert page.value("document.getElementById('at-phase').textContent") == "done"


def test_a_second_press_pauses(page, report):
    page.open(report)
    page.value("document.getElementById('play').click()")
    assert page.value("document.getElementById('play').textContent") == "Pause"
    page.value("document.getElementById('play').click()")
    assert page.value("document.getElementById('play').textContent") == "Play"
    stands = page.value(TIME_S)
    page.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert page.value(TIME_S) == stands


def test_the_arrow_keys_scrub(page, report):
    page.open(report)
    page.value("document.getElementById('time').focus()")
    before = page.value(TIME_S)
    for _ in range(5):
        page.press("ArrowRight", 39)
    assert page.value(TIME_S) == pytest.approx(before + 0.5, abs=0.11)  # ten times a second


def test_a_click_into_a_figure_scrubs_there(page, report):
    page.open(report, height=4000)
    left, top, width, height = page.value(
        "(() => { const b = document.querySelector('svg[data-name=force]').getBoundingClientRect();"
        " return [b.left, b.top, b.width, b.height]; })()"
    )
    data = page.value("document.querySelector('svg[data-name=force]').dataset.time.split(';')[0]")
    x0, _, x1, _, begin, end = map(float, data.split(","))
    units = page.value("document.querySelector('svg[data-name=force]').viewBox.baseVal.width")
    middle = (x0 + x1) / 2 / units
    page.click(left + middle * width, top + height / 2)
    assert page.value(TIME_S) == pytest.approx((begin + end) / 2, abs=0.15)


@pytest.mark.parametrize("dark", [False, True])
def test_nothing_is_wider_than_a_phone(page, report, dark):
    page.looks(dark=dark)
    page.open(report, width=390, height=844)
    assert page.value("document.documentElement.scrollWidth") <= 390
    sizes = page.value(
        "[...document.querySelectorAll('figure svg text')].map(t => t.getBoundingClientRect().height)"
        ".filter(height => height > 0)"
    )
    assert min(sizes) > 7
    page.looks()


def test_ink_on_a_dark_page_is_light(page, report):
    page.looks(dark=True)
    page.open(report)
    for what in ("body", "figure svg text"):
        property_ = "color" if what == "body" else "fill"
        rgb = page.value(f"getComputedStyle(document.querySelector('{what}')).{property_}")
        assert min(map(int, re.findall(r"\d+", rgb)[:3])) > 150
    page.looks()


def test_print_leaves_the_player_out_and_is_light(page, report):
    page.looks(dark=True, printed=True)
    page.open(report)
    assert page.value("getComputedStyle(document.getElementById('player')).display") == "none"
    rgb = page.value("getComputedStyle(document.body).backgroundColor")
    assert re.findall(r"\d+", rgb) == ["255", "255", "255"]
    page.looks()


def test_a_script_that_is_not_ours_does_not_run(page, report, tmp_path):
    changed = tmp_path / "changed.html"
    changed.write_text(report.read_text().replace("</body>", "<script>window.other = 1</script></body>"))
    page.open(changed)
    assert page.value("window.other === undefined") is True
    assert any("Content Security Policy" in problem for problem in page.problems)
    page.problems.clear()


def test_without_scripts_all_figures_are_there_and_the_player_is_not(page, report):
    page.scripts(allowed=False)
    page.open(report)
    page.scripts(allowed=True)
    assert page.value("getComputedStyle(document.getElementById('player')).display") == "none"
    assert page.value("document.querySelectorAll('figure svg').length") == 6
    assert page.value("document.querySelectorAll('line.cursor').length") == 0


def test_a_comparison_opens_on_desktop_and_phone(page, runs, tmp_path):
    assert main(["report", *(str(runs / name) for name in ("one", "two", "open")), "--out", str(tmp_path / "out")]) == 0
    for width in (1280, 390):
        page.open(tmp_path / "out" / "compare.html", width=width)
        assert page.value("document.documentElement.scrollWidth") <= width
    assert page.value("[...document.querySelectorAll('.wide')].filter(t => t.scrollWidth > t.clientWidth).length") == 0
    # On the phone each number has its name beside it, since the row of names is not above it.
    shown = page.value("getComputedStyle(document.querySelectorAll('.results td')[3], '::before').content")
    assert shown == '"distance (m)"'
