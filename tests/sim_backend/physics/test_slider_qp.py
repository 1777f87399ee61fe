"""OSQP and the closed form give the same answer; a status other than solved is an error."""

import itertools
import math

import pytest

from sim_backend.physics import slider_qp
from sim_backend.physics.slider_exact import AtRest, Moving, Separating, solve_exact
from sim_backend.physics.slider_qp import QpNotSolved, QpSolver

SQUARE_D = (0.0382598, 0.382598, 0.707107)
CIRCLE_D = (1 / 30, 1 / 3, 0.5)
FRICTION = (0.0, 0.5, 1.0)


def paper_states():
    """Contacts of the paper's square and circle over the face, with pushing angles up to 80 degrees."""
    push = [math.radians(a) for a in range(-80, 81, 16)]
    for d, mu, s, a in itertools.product(SQUARE_D, FRICTION, (-0.49, -0.4, -0.2, -0.05, 0, 0.1, 0.4), push):
        yield (-0.5, s, 1.0, 0.0, 0.1 * math.cos(a), 0.1 * math.sin(a), d, 1.0, mu)
    for d, mu, s, a in itertools.product(CIRCLE_D, FRICTION, (-0.4, 0, 0.2), push):
        side = math.pi - s / 0.5
        c, n = (math.cos(side) / 2, math.sin(side) / 2), (-math.cos(side), -math.sin(side))
        yield (*c, *n, 0.1 * (n[0] * math.cos(a) - n[1] * math.sin(a)), 0.1 * (n[1] * math.cos(a) + n[0] * math.sin(a)),
               d, 1.0, mu)  # fmt: skip


def difference(a, b):
    return max(abs(getattr(a, k) - getattr(b, k)) for k in ("vx", "vy", "omega", "slip", "fx", "fy"))


def test_agrees_with_the_closed_form_over_the_papers_states():
    solve = QpSolver()
    count = 0
    for case in paper_states():
        exact, qp = solve_exact(*case), solve(*case)
        assert isinstance(exact, Moving)
        assert isinstance(qp, Moving)
        assert qp.mode is exact.mode or max(abs(exact.slip), abs(qp.slip)) < 1e-8
        assert difference(exact, qp) < 1e-6
        count += 1
    assert count > 900


def test_same_question_same_bits_whatever_was_asked_before():
    solve = QpSolver()
    cases = list(paper_states())[::60]
    first = [solve(*case) for case in cases]
    again = [solve(*case) for case in reversed(cases)]
    assert first == again[::-1]


def test_degenerate_answers_have_the_same_types():
    solve = QpSolver()
    for v, mu, d in (
        ((-0.01, 0.1), 0.0, 0.4),
        ((0.0, 0.0), 0.5, 0.4),
        ((0.0, 0.1), 0.5, 0.4),
        ((-0.005, -0.1), 1.0, 0.0382598),
        ((0.0, 0.1), 1.0, 0.0382598),
        ((0.0, -0.1), 1.0, 0.0382598),
    ):
        exact, qp = (f(-0.5, 0.25, 1, 0, *v, d, 1.0, mu) for f in (solve_exact, solve))
        assert type(qp) is type(exact)
        if isinstance(exact, Moving):
            assert difference(exact, qp) < 1e-6
        elif isinstance(exact, AtRest):
            assert qp.slip == pytest.approx(exact.slip, abs=1e-9)
        else:
            assert exact == Separating()


def test_an_unsolved_program_is_an_error(monkeypatch):
    monkeypatch.setattr(slider_qp, "MAX_ITERATIONS", 5)
    solve = QpSolver()
    with pytest.raises(QpNotSolved, match="maximum iterations"):
        solve(-0.5, 0.25, 1, 0, 0.1, 0.02, 0.0382598, 1.0, 0.5)
