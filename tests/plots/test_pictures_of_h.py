"""Pictures of a complex H: every branch of Re ω and Im ω, EPs on them, and no word of the real system inside."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.places import PROBLEMS
from matplotlib.text import Text

import tmsopt
from tmsopt import plots

TRIMER = PROBLEMS / "pt_trimer.toml"
FOREIGN = re.compile(r"weave|capsize|carrier|heav|(Re|Im)\W*s\b")


@pytest.fixture(scope="module")
def trimer():
    return tmsopt.solve(TRIMER)


def words_of(figure):
    return [re.sub(r"\\mathrm|[{}$]", "", t.get_text()) for t in figure.findobj(Text)]


def eigenvalues(x, gain, loss):
    return np.linalg.eigvals(np.array([[x + 1j * gain, 1, 0], [1, 0, 1], [0, 1, -1j * loss]]))


def test_all_branches_are_drawn_to_their_ends(trimer):
    """The eigenvalues of H themselves, over d1 at gain = loss = √2, where an EP3 is 0."""
    figure = plots.growth_figure(tmsopt.growth(trimer, over="d1"))
    upper, lower = figure.axes
    assert (upper.get_ylabel(), lower.get_ylabel()) == (
        r"$\mathrm{Im}\,\omega$ (loss negative)",
        r"$\mathrm{Re}\,\omega$",
    )
    assert not [w for w in words_of(figure) if FOREIGN.search(w)]
    for ax, part in ((upper, "imag"), (lower, "real")):
        curves = [line for line in ax.lines if len(line.get_xdata()) > 10]
        bottom, top = ax.get_ylim()
        for x in (-1.0, -0.37, 0.21, 1.0):
            drawn = [
                np.interp(x, *line.get_data()) for line in curves if line.get_xdata()[0] <= x <= line.get_xdata()[-1]
            ]
            for y in getattr(eigenvalues(x, math.sqrt(2), math.sqrt(2)), part):
                assert bottom < y < top
                assert min(abs(y - d) for d in drawn) < 1e-5
        (marks,) = (line for line in ax.lines if line.get_label() == "eigenfrequencies meet")
        assert np.abs(np.array(marks.get_data())).max() < 1e-12
        assert "EP3" in words_of(ax)


def test_a_frequency_far_from_0_fills_the_picture():
    """200 ± √(1 − g²): 0 is not among what is shown."""
    pair = tmsopt.models.from_hamiltonian([["200 + 1j*g", 1], [1, "200 - 1j*g"]])
    ax = plots.draw_frequencies(tmsopt.growth(tmsopt.Problem(pair, fixed={"g": 0.5}), over="g"))
    bottom, top = ax.get_ylim()
    assert 198 < bottom < 199.01
    assert 200.99 < top < 202


def test_roots_are_eigenfrequencies(trimer):
    """−3 − 0.2i and 1 + 0.1i stand at (−3, −0.2) and (1, 0.1); an EP at 0 stands at 0."""
    apart = tmsopt.models.from_hamiltonian([["w - 0.2j", 0], [0, "1 + 0.1j"]])
    ax = plots.draw_roots(tmsopt.solve(tmsopt.Problem(apart, fixed={"w": -3.0})))
    marks = sorted(tuple(np.ravel(line.get_data())) for line in ax.lines if line.get_marker() == "o")
    assert np.allclose(marks, [(-3, -0.2), (1, 0.1)], rtol=0, atol=1e-12)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\mathrm{Re}\,\omega$", r"$\mathrm{Im}\,\omega$ (loss negative)")
    left, right = plots.draw_roots(trimer).get_xlim()
    assert right - left > 1


@pytest.mark.slow
def test_a_chart_and_a_trace_speak_of_h(trimer):
    fixed, free = {"k": 1.0, "loss": 1.0, "d3": 0.0}, {"gain": (0.2, 2.0), "d1": (-1.0, 1.0)}
    edge = tmsopt.Problem(trimer.problem.model, fixed=fixed, free=free, locate="weave")
    chart = tmsopt.chart(replace(edge, locate=None), points=(12, 12))
    traced = plots.trace_figure(tmsopt.trace(edge))
    for figure in (plots.chart_figure(chart, "abscissa"), plots.chart_figure(chart), traced):
        assert not [w for w in words_of(figure) if FOREIGN.search(w)]
    assert "threshold" in words_of(traced)
    assert any("largest Im" in w for w in words_of(plots.chart_figure(chart, "abscissa")))


def test_what_happens_over_a_phase_is_told_of_h():
    """Where entries are no polynomials, crossings are found by halving, and are of ω all the same.

    H = [[5, e^(iφ)], [e^(iφ), 5]] − 0.5i has ω = 5 − 0.5i ± e^(iφ): Im ω = 0 at sin φ = 1/2, where Re ω = 5 + cos φ.
    """
    H = [["5 - 0.5j", "exp(1j*phi)"], ["exp(1j*phi)", "5 - 0.5j"]]
    problem = tmsopt.Problem(tmsopt.models.from_hamiltonian(H), fixed={"phi": 0.1})
    (event,) = tmsopt.growth(problem, over="phi", end=1.0).events
    assert event.at == pytest.approx(math.pi / 6, rel=1e-9)
    assert -event.root.im == pytest.approx(5 + math.cos(math.pi / 6), rel=1e-9)
