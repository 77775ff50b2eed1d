"""Riemann sheets, against closed forms."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.places import PROBLEMS
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import tmsopt
from tmsopt import plots
from tmsopt.models import from_hamiltonian, from_matrices
from tmsopt.spectra import sheets

DIMER = PROBLEMS / "loss_only_dimer.toml"


def dimer(d, k):
    """d/2 − 0.6i ± √((d − 0.8i)²/4 + k²)"""
    root = np.sqrt((d - 0.8j) ** 2 / 4 + k**2)
    return np.stack([d / 2 - 0.6j - root, d / 2 - 0.6j + root], axis=-1)


def test_values_are_the_eigenfrequencies_in_the_order_of_their_real_parts():
    over = sheets(DIMER, grid=(21, 11))
    d, k = np.meshgrid(*over.grid)
    assert over.axes == ("d", "k")
    assert (over.grid[0][[0, -1]].tolist(), over.grid[1][[0, -1]].tolist()) == ([-1, 1], [0.05, 2])
    assert np.abs(over.values - dimer(d, k)).max() < 1e-12
    assert over.multiple == (pytest.approx(-0.6j, abs=1e-12),)
    assert over.parameters == pytest.approx({"d": 0, "k": 0.4, "eps": 0, "g1": 1, "g2": 0.2}, abs=1e-9)


def test_the_order_of_equal_real_parts_does_not_depend_on_rounding():
    """Below the EP2, at d = 0, both real parts are 0; −0.6i ∓ i √(0.16 − k²)."""
    over = sheets(DIMER, over=("k", "d"), grid=(21, 3))
    row = over.values[1, over.grid[0] < 0.39]
    assert np.abs(row.real).max() < 1e-12
    assert (row[:, 0].imag < row[:, 1].imag).all()


def test_values_that_are_not_defined_are_nan():
    """The mass m is 0 on the left side of the box."""
    oscillator = from_matrices(M=[["m"]], D=[[0]], K=[["k"]])
    over = sheets(tmsopt.Problem(oscillator, free={"m": (0, 1), "k": (1, 2)}), grid=(3, 3))
    assert np.isnan(over.values[:, 0]).all()
    assert over.values[0, 2].tolist() == [-1j, 1j]
    assert json.dumps(over.to_json(), allow_nan=False)


def test_eight_sheets_nearest_to_a_multiple_eigenvalue_are_drawn():
    """Six oscillators without damping, with the frequencies 1 … 4 and two of about 5 to 6."""
    squares = [1, 4, 9, 16, "25 + k", "30 + c"]
    stiffness = [[x if i == j else 0 for j in range(6)] for i, x in enumerate(squares)]
    system = from_matrices(M=np.eye(6).tolist(), D=np.zeros((6, 6)).tolist(), K=stiffness)
    over = sheets(tmsopt.Problem(system, free={"c": (0, 2), "k": (0, 2)}), grid=(5, 5))
    assert over.values.shape == (5, 5, 12)
    assert over.picture_indices == [*range(8)]
    located = replace(over, multiple=(5.5j,))
    assert sorted(over.values[2, 2, located.picture_indices].imag) == pytest.approx(
        [-2, -1, 1, 2, 3, 4, 26**0.5, 31**0.5]
    )
    assert "8 sheets" in located.report()
    assert len(plots.sheets_figure(located).axes) == 4


def test_tables_have_a_row_for_each_point(tmp_path):
    over = sheets(DIMER, grid=(3, 2))
    over.write_csv(tmp_path / "sheets.csv")
    head, *rows = csv.reader((tmp_path / "sheets.csv").read_text(encoding="utf-8").splitlines())
    assert head == ["d", "k", "omega0_re", "omega0_im", "omega1_re", "omega1_im"]
    numbers = np.array(rows, dtype=float)
    assert numbers[:, :2].tolist() == [[-1, 0.05], [0, 0.05], [1, 0.05], [-1, 2], [0, 2], [1, 2]]
    expected = dimer(numbers[:, 0], numbers[:, 1]).view(float)
    assert np.abs(numbers[:, 2:] - expected).max() < 1e-12
    data = over.to_json()
    assert np.array(data["omega"]["im"]).shape == (2, 3, 2)
    assert data["multiple"] == [pytest.approx([0, -0.6])]


def test_a_picture_has_a_surface_for_each_part_and_a_mark_at_the_point():
    over = sheets(DIMER, grid=(9, 9))
    for ax, z in zip(plots.sheets_figure(over).axes[::2], (0, -0.6), strict=True):
        (surface,) = (c for c in ax.collections if isinstance(c, Poly3DCollection))
        assert len(surface.get_facecolor()) >= 2 * 8 * 8
        (mark,) = ax.lines
        assert np.ravel(mark.get_data_3d()) == pytest.approx([0, 0.4, z], abs=1e-9)
    with pytest.raises(tmsopt.InputError, match=r"ax: found .*projection='3d'"):
        plots.draw_sheets(over, plots.new_figure(3, 3).subplots())


def test_a_picture_of_a_loop_has_starts_ends_and_points():
    loop = tmsopt.encircle(DIMER, 0.1)
    left, right = plots.loop_figure(loop).axes
    circle = left.lines[0].get_xydata()
    assert np.hypot(circle[:, 0], circle[:, 1] - 0.4) == pytest.approx(0.1, abs=1e-12)
    assert [t.get_text() for t in left.texts if t.get_text()] == ["EP2"]
    starts = [complex(*line.get_xydata()[0]) for line in right.lines if line.get_marker() == "o"]
    ends = [complex(*line.get_xydata()[0]) for line in right.lines if line.get_marker() == "s"]
    assert starts == pytest.approx(dimer(0.1, 0.4).tolist())
    assert ends == pytest.approx(starts[::-1])


def test_a_file_with_units_is_drawn_in_its_units():
    """x in cm: a circle of 0.01 m is one of 1 cm."""
    H = from_hamiltonian([["x - 1j", "y"], ["y", "1j"]])
    problem = tmsopt.Problem(H, free={"x": (-1, 1), "y": (0.5, 1.5)})
    loop = tmsopt.encircle(problem, 0.01, centre={"x": 0.0, "y": 1.0})
    assert loop.permutation == (1, 0)
    assert "x = 0 + 0.01 cos t, y = 1 + 0.01 sin t" in loop.report()


def test_few_free_parameters_are_refused():
    one = tmsopt.Problem(from_hamiltonian([["x", 1], [1, "2j"]]), free={"x": (0, 1)})
    with pytest.raises(tmsopt.InputError, match="two parameters must be free, found 1"):
        sheets(one)
    assert math.isfinite(abs(sheets(DIMER, grid=(2, 2)).values[0, 0, 0]))
