"""Petermann factors over a parameter: against closed forms, and as curves."""

import numpy as np
import pytest

import tmsopt
from tmsopt import plots
from tmsopt.models import from_hamiltonian, from_matrices


@pytest.fixture(scope="module")
def dimer():
    """g from 0 to 2 at k = 1: an exceptional point at g = 1."""
    model = from_hamiltonian([["1j*g", "k"], ["k", "-1j*g"]])
    return tmsopt.growth(tmsopt.Problem(model, fixed={"g": 1.0, "k": 1.0}), over="g", petermann=True)


def test_gain_and_loss_are_balanced(dimer):
    """max(g², k²)/|g² − k²|, wherever double precision tells g from k."""
    regular = abs(dimer.values - 1) > 1e-9
    g = dimer.values[regular]
    wanted = np.maximum(g, 1) ** 2 / abs(g - 1) / (g + 1)
    assert dimer.petermann.shape == dimer.roots.shape
    assert dimer.petermann[regular] == pytest.approx(np.stack([wanted, wanted], axis=1), rel=1e-5)
    assert np.all(dimer.petermann[~regular] > 1e8)


def test_each_factor_belongs_to_its_root():
    """Two uncoupled oscillators: K of one changes with its stiffness k, and K of the other one stays."""
    model = from_matrices(M=[[1, 0], [0, 1]], D=[[0.2, 0], [0, 0.4]], K=[["k", 0], [0, 9]])
    found = tmsopt.growth(tmsopt.Problem(model, fixed={"k": 2.0}), over="k", petermann=True)
    resting = abs(found.roots.imag) > 2.5

    def factor(c, k):
        return 1 + (1 + k**2 + c**2 - 2 * k) / abs(c**2 - 4 * k)

    underdamped = found.values > 0.1
    assert found.petermann[resting] == pytest.approx(factor(0.4, 9.0), rel=1e-9)
    k = np.repeat(found.values[underdamped, None], 4, axis=1)
    moving = ~resting[underdamped]
    assert found.petermann[underdamped][moving] == pytest.approx(factor(0.2, k[moving]), rel=1e-7)


def test_rows_and_json_have_the_factors_only_if_requested(tmp_path):
    plain = tmsopt.growth("problems/benchmark.toml")
    assert plain.petermann is None
    assert "petermann" not in plain.to_json()
    assert not [name for name in next(iter(plain.records())) if "petermann" in name]
    plain.write_csv(tmp_path / "growth.csv")
    header, *rows = (tmp_path / "growth.csv").read_text(encoding="utf-8").splitlines()
    assert header.startswith("v (m/s),re_1,im_1")
    assert len(rows) == len(plain.values)
    with pytest.raises(tmsopt.InputError, match="petermann=True"):
        plots.draw_petermann(plain)


def test_the_curves_are_drawn_on_a_logarithmic_scale(dimer):
    figure = plots.growth_figure(dimer)
    *_, ax = figure.axes
    assert (len(figure.axes), ax.get_yscale(), ax.get_ylabel()) == (3, "log", "Petermann factor")
    curves = [line.get_data() for line in ax.lines if len(line.get_xdata()) > 10]
    for g in (0.5, 1.5):
        drawn = [np.interp(g, *curve) for curve in curves if curve[0].min() <= g <= curve[0].max()]
        assert drawn == pytest.approx([max(g, 1) ** 2 / abs(g**2 - 1)] * 2, rel=1e-4)
    assert len(plots.growth_figure(tmsopt.growth("problems/benchmark.toml")).axes) == 2
