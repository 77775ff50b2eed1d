"""Stability charts against exact classes; `tmsopt trace` and `tmsopt chart` by their contract, in processes."""

import csv
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from helpers import curves
from helpers.commands import tmsopt
from helpers.curves import exact_polynomial, sturm
from helpers.oracles import certified_roots

from tmsopt.charts import chart
from tmsopt.errors import InputError
from tmsopt.models import tms
from tmsopt.problem import Problem, load
from tmsopt.roots import CLASSES

BASE = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
SQRT2 = math.sqrt(2)
FR_EP4 = 3 * math.sqrt(110 * SQRT2 - 120) / 8  # Table 1
OMEGA0 = -(12.5**0.25)  # Table 1

PLANES = {
    "on the law": (BASE | {"chi_B": SQRT2}, {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4)}),
    "both tilts": (BASE | {"Fr": FR_EP4 + 0.5}, {"chi_B": (-1.0, 3.0), "lambda_s": (-1.4, 1.4)}),
    "chi_H = 1.02": (
        {"chi_H": 1.02, "mu": 20.8, "Fr": 2.337, "zeta_B": -0.4, "zeta_H": -0.2},
        {"chi_B": (0.5, 3.0), "lambda_s": (-1.4, 1.4)},
    ),
    "masses": (
        {"chi_B": 1.3, "Fr": 3.0, "lambda_s": 0.4, "zeta_B": -0.4, "zeta_H": -0.2},
        {"mu": (0.1, 30.0), "chi_H": (0.8, 1.2)},
    ),
}


def charted(fixed, free, axes=None, constraints=None, **options):
    problem = Problem(model=tms, fixed=fixed, free=free, constraints=constraints or {})
    return chart(problem, axes, **{"points": (41, 30), "boundaries": False} | options)


def cells(found, count, seed=0):
    """Random grid points: indices and every parameter."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        i, j = int(rng.integers(found.kind.shape[0])), int(rng.integers(found.kind.shape[1]))
        free = {found.axes[0]: float(found.grid[0][j]), found.axes[1]: float(found.grid[1][i])}
        yield (i, j), {**found.problem.fixed, **free}


@pytest.mark.parametrize("name", PLANES)
def test_classes_and_counts_are_exact_at_random_designs(name):
    found = charted(*PLANES[name])
    seen = set()
    for at, design in cells(found, 250):
        a = exact_polynomial(design)
        expected = curves.kind(a)
        assert CLASSES[found.kind[at]] == expected
        assert found.real_roots[at] == sum(sturm(a))
        seen.add(expected)
    assert len(seen) >= 3


@pytest.mark.parametrize("name", PLANES)
def test_abscissa_and_damping_ratio_are_those_of_isolated_roots(name):
    found = charted(*PLANES[name])
    for at, design in cells(found, 40, seed=1):
        roots = [complex(z) for z, _ in certified_roots(exact_polynomial(design))]
        # a random design is 1e-3 or more from a double root: its roots move by 1e3 units of rounding of their size
        size = max(map(abs, roots))
        assert found.abscissa[at] == pytest.approx(max(z.real for z in roots), abs=1e-10 * size)
        assert found.damping_ratio[at] == pytest.approx(min(-z.real / abs(z) for z in roots), abs=1e-8)


def test_shape_axes_and_shares():
    fixed, free = PLANES["on the law"]
    found, turned = charted(fixed, free), charted(fixed, free, ("lambda_s", "Fr"), points=(30, 41))
    assert found.axes == ("Fr", "lambda_s")
    assert turned.axes == ("lambda_s", "Fr")
    assert found.kind.shape == (30, 41)
    for name in ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied"):
        assert np.array_equal(getattr(found, name), getattr(turned, name).T)
    for grid, n in zip(found.grid, found.axes, strict=True):
        assert (grid[0], grid[-1]) == free[n]
    assert sum(found.shares.values()) == pytest.approx(1.0, abs=1e-14)
    assert list(found.shares) == list(CLASSES)
    for code, name in enumerate(CLASSES):
        assert found.shares[name] == np.count_nonzero(found.kind == code) / found.kind.size


def test_a_singular_mass_matrix_is_undefined():
    """chi_H = 1 and lambda_s = 0: nu_H = 0, a0 = a4 = 0."""
    found = charted(BASE | {"chi_B": 1.3}, {"Fr": (0.1, 5.0), "lambda_s": (-0.5, 0.5)}, points=(7, 21))
    singular = np.broadcast_to((found.grid[1] == 0)[:, None], (21, 7))
    assert np.array_equal(found.kind == 0, singular)
    assert np.all(found.real_roots[singular] == 0)
    for layer in (found.abscissa, found.damping_ratio):
        assert np.array_equal(np.isnan(layer), singular)
    assert found.shares["undefined"] == pytest.approx(1 / 21)
    json.dumps(found.to_json(), allow_nan=False)
    everywhere = charted(BASE | {"lambda_s": 0.0}, {"Fr": (0.1, 5.0), "chi_B": (1.1, 2.0)}, points=(5, 4))
    assert everywhere.shares["undefined"] == 1.0
    assert everywhere.to_json()["least_abscissa"] is None
    json.dumps(everywhere.to_json(), allow_nan=False)


def test_constraints_are_held_where_they_hold():
    constraints = {"fast": "Fr >= 1.2 * Fr_c", "tilt": "tan(lambda_s) + Fr <= 3", "rate": "abscissa <= -0.3"}
    fixed, free = PLANES["on the law"]
    found = charted(fixed, free, constraints=constraints)
    for at, design in cells(found, 150, seed=4):
        T = math.tan(design["lambda_s"])
        critical = math.sqrt(curves.FR_C2_SLOPE * T)
        alpha = max(float(z.real) for z, _ in certified_roots(exact_polynomial(design)))
        expected = design["Fr"] >= 1.2 * critical and T + design["Fr"] <= 3 and alpha <= -0.3
        assert bool(found.satisfied[at]) == expected
    assert 0 < np.mean(found.satisfied) < 1


def test_least_abscissa_is_the_least():
    found = charted(*PLANES["on the law"])
    best = found.to_json()["least_abscissa"]
    design = PLANES["on the law"][0] | {n: best[n] for n in ("Fr", "lambda_s")}
    roots = [float(z.real) for z, _ in certified_roots(exact_polynomial(design))]
    assert best["value"] == pytest.approx(max(roots), abs=1e-9)
    assert best["value"] == found.abscissa.min() >= OMEGA0  # `w0` bounds them all


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, "0 are free"), (1, "1 are free"), (3, "accepted: three whole numbers"), (4, "fix the others")],
)
def test_what_is_no_plane_is_refused(count, words):
    free = dict([("Fr", (0.1, 5.0)), ("chi_B", (1.1, 2.0)), ("lambda_s", (0.1, 1.0)), ("mu", (1.0, 9.0))][:count])
    fixed = {n: v for n, v in {**BASE, "Fr": 2.0, "chi_B": 1.3, "lambda_s": 0.3}.items() if n not in free}
    with pytest.raises(InputError, match=words):
        charted(fixed, free)


# The command line


def test_trace_writes_table_csv_and_figure(tmp_path, run):
    table, figure = tmp_path / "branches.csv", tmp_path / "branches.svg"
    asked = ("trace", "problems/ep_set.toml", "--starts", 8, "--csv", table, "--plot", figure, "--axes", "lambda_s,Fr")
    status, out, err = run(*asked)
    assert status == 0
    assert err.splitlines() == [f"wrote {table}", f"wrote {figure}"]
    assert "EP4" in out
    assert "1.41421356237" in out  # chi_B = √2, Table 1
    assert "2.23631751" in out  # Fr_EP4, printed in the paper
    assert figure.read_bytes().startswith(b"<?xml")
    lines = table.read_text(encoding="utf-8").splitlines()
    parameters, slopes = "Fr,mu,chi_B,chi_H,zeta_B,zeta_H,lambda_s (rad)", "d_Fr,d_chi_B,d_lambda_s"
    assert lines[0] == (
        f"branch,arclength,{parameters},{slopes},b,c,abscissa,kind,stable,heavily_damped,constraints,event"
    )
    rows = list(csv.DictReader(lines))
    (ep4,) = [row for row in rows if row["kind"] == "EP4"]
    assert float(ep4["Fr"]) == pytest.approx(FR_EP4, abs=1e-12)
    assert "EP4" in ep4["event"]


NOTHING = """
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = 1.3
Fr = { min = 0.01, max = 0.02 }
lambda_s = { min = 1.2, max = 1.3 }
"""


def test_nothing_found_ends_with_3_and_says_so(tmp_path, run):
    path = tmp_path / "nothing.toml"
    path.write_text(NOTHING)
    status, out, err = run("trace", path, "--pattern", "weave", "--json", "--starts", 4)
    assert status == 3
    assert "no weave found" in err
    assert json.loads(out)["branches"] == []


def test_chart_json_is_finite(run):
    status, out, err = run("chart", "problems/chart.toml", "--points", "30", "--no-boundaries", "--json")
    assert (status, err) == (0, "")
    data = json.loads(out, parse_constant=pytest.fail)
    assert data["axes"]["Fr"] == {"min": 0.01, "max": 5.0, "points": 30, "unit": "1"}
    assert sum(data["classes"].values()) == pytest.approx(1)
    assert data["boundaries"] is None


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_an_output_that_cannot_be_written_ends_with_2(tmp_path):
    path = tmp_path / "chart.npz"
    path.symlink_to("/dev/full")
    done = tmsopt("chart", "problems/chart.toml", "--points", "5", "--no-boundaries", "-o", path)
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert "wrote" not in done.stderr
    assert "Traceback" not in done.stderr


def test_what_memory_has_no_room_for_is_refused():
    with pytest.raises(InputError, match=r"points: 1e\+08 designs do not fit into memory; give a folder"):
        plain((10_000, 10_000))


def plain(points, **changes):
    """The chart of problems/chart.toml with changes, without boundaries."""
    return chart(dataclasses.replace(load("problems/chart.toml"), **changes), points=points, boundaries=False)


def test_the_least_abscissa_satisfies_the_constraints():
    free = plain((40, 30))
    best = free.to_json()["least_abscissa"]
    found = plain((40, 30), constraints={"slow": f"Fr <= {best['Fr'] / 2}"})
    allowed = found.grid[0] <= best["Fr"] / 2
    assert found.to_json()["least_abscissa"]["value"] == free.abscissa[:, allowed].min()
    never = plain((5, 5), constraints={"never": "Fr >= 100"})
    assert never.to_json()["least_abscissa"] is None
    assert "least abscissa" not in never.report()


def test_an_equality_is_left_aside_and_said_to_be():
    found = plain((5, 5), constraints={"law": "Fr == 2"})
    assert found.left_aside == ("law",)
    assert found.satisfied.all()
    assert "law is ignored" in found.report()


def test_the_margin_is_the_difference_of_the_sides():
    found = plain((12, 9), constraints={"slow": "Fr <= 2", "steep": "lambda_s >= 0.3"})
    Fr, tilt = np.meshgrid(*found.grid)
    assert np.array_equal(found.margin, np.minimum(2 - Fr, tilt - 0.3))
    assert np.array_equal(found.satisfied, (Fr <= 2) & (tilt >= 0.3))


def test_a_huge_box_is_charted_without_a_warning():
    problem = dataclasses.replace(load("problems/chart.toml"), free={"Fr": (0.1, 1e50), "lambda_s": (0.01, 1.4)})
    assert chart(problem, points=(20, 15)).shares["undefined"] == 0  # Fr² is a double
