"""Figures on a page: few points that keep every peak, own ids, colours that follow dark and light, words for each."""

import re

import numpy as np
import pytest

from tools.report.alt_texts import alt_texts
from tools.report.drawing.figures import FIGURES
from tools.report.drawing.style import style
from tools.report.drawing.svg import inline_svg
from tools.report.drawing.thinned import MOST_POINTS, thinned, thinned_path
from tools.report.run_data import read_run


def test_thinning_keeps_every_peak_and_both_ends():
    x = np.arange(60_000.0)
    y = np.zeros(60_000)
    y[[1234, 40_000]] = 5.0, -7.0
    tx, ty = thinned(x, y)
    assert len(tx) <= MOST_POINTS
    assert (tx[0], tx[-1]) == (0.0, 59_999.0)
    assert (ty.max(), ty.min()) == (5.0, -7.0)
    assert np.all(np.diff(tx) > 0)


def test_thinning_keeps_gaps():
    y = np.ones(60_000)
    y[20_000:40_000] = np.nan
    x, y = thinned(np.arange(60_000.0), y)
    assert np.isnan(y[(x > 20_200) & (x < 39_800)]).all()
    assert np.isfinite(y[(x < 20_000) | (x > 40_000)]).all()


def test_a_short_line_is_left_as_it_is():
    x = np.arange(10.0)
    assert thinned(x, x)[0] is x
    assert thinned_path(x, x)[0] is x


@pytest.fixture(scope="module")
def svgs(runs):
    run = read_run(runs / "one" / "run.mcap")
    with style():
        return {name: inline_svg(draw(run), name, f"<{name}>") for name, draw in FIGURES.items()}


def test_figures_share_no_ids_and_refer_to_their_own(svgs):
    every = [identifier for text in svgs.values() for identifier in re.findall(r'\bid="([^"]*)"', text)]
    assert len(every) == len(set(every))
    for text in svgs.values():
        assert set(re.findall(r'(?:url\(|href=")#([^")]*)', text)) <= set(re.findall(r'\bid="([^"]*)"', text))


def test_words_are_escaped_and_axes_are_told(svgs):
    for name, text in svgs.items():
        assert f'aria-label="&lt;{name}&gt;"' in text
        assert ("data-plan=" in text) == (name == "trajectory")
        assert ("data-time=" in text) == (name != "trajectory")
    assert len(re.search('data-time="([^"]*)"', svgs["tracking"])[1].split(";")) == 3


def test_ink_and_paper_follow_the_reader(svgs):
    for text in svgs.values():
        assert "#ffffff" not in re.sub(r"var\([^)]*\)", "", text)
        assert "#222222" not in re.sub(r"var\([^)]*\)", "", text)


def test_every_figure_tells_its_result_in_numbers(runs):
    run = read_run(runs / "one" / "run.mcap")
    texts = alt_texts(run)
    assert set(texts) == set(FIGURES)
    assert re.search(r"after 0\.[23]\d m", texts["trajectory"])
    assert "N while pushing, median" in texts["force"]
    assert "0.1 m/s are set" in texts["speed"]
    assert "no fault" in texts["safety"]
    assert "virtual clock" in texts["timing"]
