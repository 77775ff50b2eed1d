"""Regions, robustness and charts of models of degrees 2 to 12: closed forms, exact arithmetic, eigenvalues of dense rays.

Most radii are those of oscillators side by side, ∏ (s² + cᵢ s + kᵢ), whose boundaries are known one by one: weave at
cᵢ = 0, capsize at kᵢ = 0, heavy damping at cᵢ² = 4 kᵢ.
"""

from fractions import Fraction

import numpy as np
import pytest
from helpers import curves
from helpers.oracles import routh_exact

from tmsopt.boundaries import nearest, robustness
from tmsopt.charts import chart
from tmsopt.dynamics import growth
from tmsopt.evaluation import omega0_bound, prove_worst_case
from tmsopt.models import Model, Parameter, ParameterSet, from_coefficients
from tmsopt.plots import chart_figure, growth_figure
from tmsopt.problem import Problem
from tmsopt.roots import (
    CLASSES,
    classify,
    find_motion,
    is_stable,
    product,
    quadratic_pencil,
    roots,
)
from tmsopt.search import solve


def model(names, degree, polynomial):
    parameters = tuple(Parameter(n, "1", n, n) for n in names)
    sets = (ParameterSet("plain", parameters, dict),)
    return Model(name="toy", title="toy", degree=degree, sets=sets, algebraic=dict, polynomial=polynomial)


def oscillators(count, odd=False):
    """∏ (s² + cᵢ s + kᵢ), times s + a where the degree is odd."""
    names = [f"{letter}{k}" for letter in "ck" for k in range(count)] + ["a"] * odd
    return model(
        names,
        2 * count + odd,
        lambda **p: product(*([1, p[f"c{k}"], p[f"k{k}"]] for k in range(count)), *([[1, p["a"]]] if odd else [])),
    )


def chain(count):
    """Unit masses in a row between a wall and nothing, with springs k and dampers c: det(M s² + D s + K)."""

    def matrix(x):
        x = [*x, 0.0]
        return [
            [x[i] + x[i + 1] if i == j else -x[max(i, j)] if abs(i - j) == 1 else 0.0 for j in range(count)]
            for i in range(count)
        ]

    def polynomial(**p):
        M = [[float(i == j) for j in range(count)] for i in range(count)]
        return quadratic_pencil(M, *(matrix([p[f"{letter}{k}"] for k in range(count)]) for letter in "ck"))

    return model([f"{letter}{k}" for letter in "ck" for k in range(count)], 2 * count, polynomial)


def stacked(of, parameters):
    return np.stack(np.broadcast_arrays(*of.coefficients(parameters)), axis=-1).astype(float)


# Signs


@pytest.mark.parametrize("degree", [5, 6, 9, 12])
def test_stability_beside_the_axis_is_that_of_the_very_coefficients(degree):
    """(s² + 2d s + 1)(s + 1)ⁿ⁻²: integers over 2⁴⁰, so exact in double precision, and beside them the next doubles."""
    for damping in (0.0, 2.0**-40, -(2.0**-40)):
        c = np.array(product([1, damping, 1], *[[1, 1]] * (degree - 2)), dtype=float)
        assert is_stable(c) == is_stable(-c) == (damping > 0)
        for k in range(degree + 1):
            moved = c.copy()
            moved[k] = np.nextafter(moved[k], 0)
            assert is_stable(moved) == routh_exact([Fraction(x) for x in moved.tolist()])


# Robustness radii in closed form


def parabola(c, k):
    """Distance of (c, k) to c² = 4 k, c ≥ 0, by its normal x³/8 + (1 − k/2) x = c."""
    z = np.roots([1 / 8, 0, 1 - k / 2, -c])
    return min(np.hypot(x - c, x * x / 4 - k) for x in [*z[np.abs(z.imag) < 1e-9].real, 0.0] if x >= 0)


@pytest.mark.parametrize(
    ("c", "k", "a"),
    [
        ((0.5,), (2.0,), None),
        ((0.6,), (1.1,), 0.9),
        ((0.5, 0.9, 0.7), (2.1, 0.8, 1.4), None),
        ((0.6, 0.6), (1.5, 1.5), None),  # equal pairs: factors that coincide
    ],
)
def test_oscillators_side_by_side(c, k, a):
    of = oscillators(len(c), a is not None)
    design = dict(zip(of.sets[0].names, [*c, *k, *([a] if a else [])], strict=True))
    found = robustness(Problem(model=of, fixed=design), weights=dict.fromkeys(design, 1.0))
    assert found.stable
    assert not found.heavily_damped
    assert found.weave.distance == pytest.approx(min(c), rel=1e-10)
    assert found.capsize.distance == pytest.approx(min([*k, *([a] if a else [])]), rel=1e-10)
    assert not found.infinity.found
    assert found.radius == min(found.weave.distance, found.capsize.distance)
    ways = [parabola(x, y) for x, y in zip(c, k, strict=True)]
    # Every pair must become real: at the corner of all, whose constraints hold to 1e-10 of the coefficients.
    assert found.heavy_damping.distance == pytest.approx(float(np.linalg.norm(ways)), rel=1e-8)


def test_a_root_0_of_an_unstable_quintic_is_no_capsize():
    """At x = 1 a pair is right of the axis; yet s⁴ + 2.5 s³ + 3.5 s² + s + 4, the rest, passes all but one inequality."""
    of = model(("x",), 5, lambda x: product([1, 0.5 - x, 1], [1, 3, 4], [1, 1 - x]))
    found = robustness(Problem(model=of, fixed={"x": 0.0}), weights={"x": 1.0})
    assert found.weave.distance == pytest.approx(0.5, rel=1e-12)
    assert not found.capsize.found


def test_a_mass_that_may_vanish():
    """m s² + c s + k: stable for one sign of all three, so each relative change alone may be −1; c² = 4 m k."""
    of = model(("m", "c", "k"), 2, lambda m, c, k: [m, c, k])
    design = {"m": 2.0, "c": 1.5, "k": 3.0}
    found = robustness(Problem(model=of, fixed=design))
    assert [n.distance for n in (found.weave, found.capsize, found.infinity)] == pytest.approx([1, 1, 1], rel=1e-12)
    p = found.heavy_damping.parameters
    assert p["c"] ** 2 == pytest.approx(4 * p["m"] * p["k"], rel=1e-12)
    u = [found.heavy_damping.direction[n] for n in design]
    slope = [-4 * p["k"] * 2.0, 2 * p["c"] * 1.5, -4 * p["m"] * 3.0]
    assert abs(np.dot(u, slope)) == pytest.approx(np.linalg.norm(u) * np.linalg.norm(slope), rel=1e-10)


def test_a_cubic_on_the_routh_surface():
    """s³ + 2 s² + 2 s + 1 in its own coefficients: nearest to a1 a2 = a3 at a1 = a2 = x with x³ = 2."""
    of = model(("a1", "a2", "a3"), 3, lambda a1, a2, a3: [1, a1, a2, a3])
    found = nearest(
        Problem(model=of, fixed={"a1": 2.0, "a2": 2.0, "a3": 1.0}),
        "weave",
        weights=dict.fromkeys(("a1", "a2", "a3"), 1),
    )
    x = 2 ** (1 / 3)
    assert [found.parameters[n] for n in ("a1", "a2", "a3")] == pytest.approx([x, x, x * x], rel=1e-12)
    assert found.distance == pytest.approx(np.sqrt(2 * (x - 2) ** 2 + (x * x - 1) ** 2), rel=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
def test_an_ep_of_all_roots_is_on_the_edge_of_heavy_damping(degree):
    names = [f"b{k}" for k in range(1, degree + 1)]
    of = model(names, degree, lambda **p: [1, *(p[n] for n in names)])
    design = dict(zip(names, product(*[[1, 1]] * degree)[1:], strict=True))
    found = nearest(Problem(model=of, fixed=design), "heavy damping")
    assert found.distance == 0


def test_no_ray_of_a_chain_of_three_masses_finds_a_nearer_change():
    """2000 directions, half of them around the answer's, at radii below the one reported."""
    of = chain(3)
    design = {"c0": 0.3, "c1": 0.25, "c2": 0.4, "k0": 1.0, "k1": 0.8, "k2": 1.3}
    found = robustness(Problem(model=of, fixed=design), weights=dict.fromkeys(design, 0.5)).limit
    rays = np.random.default_rng(1).standard_normal((2000, 6))
    answer = np.array([found.direction[n] for n in design])
    rays[::2] = answer / found.distance + 0.1 * rays[::2]
    rays *= found.distance / np.linalg.norm(rays, axis=1, keepdims=True)

    def right(u):
        return roots(stacked(of, {n: x + 0.5 * u[:, k] for k, (n, x) in enumerate(design.items())})).real.max(axis=1)

    for share in (1 - 1e-6, 0.8, 0.4):
        assert np.all(right(share * rays) < 0)
    assert right((1 + 1e-5) * answer[None]) > 0
    assert found.refined


# Worst cases and charts


def test_a_band_of_a_chain_is_proved_stable():
    of = chain(3)
    fixed = {"c0": 0.4, "c1": 0.4, "c2": 0.4, "k0": 1.0, "k1": 1.0, "k2": 1.0}
    problem = Problem(model=of, fixed=fixed, tolerances={"k1": 0.05})
    k = np.linspace(0.95, 1.05, 2001)
    least = float(roots(stacked(of, fixed | {"k1": k})).real.max())
    assert prove_worst_case(problem.posed, fixed, least).proven
    assert not prove_worst_case(problem.posed, fixed, least - 1e-3, max_boxes=50).proven


@pytest.mark.parametrize("degree", [2, 5, 12])
def test_classes_of_any_degree_are_exact(degree):
    rng = np.random.default_rng(degree)
    rows = []
    for _ in range(25):
        factors = [[1, int(x), int(y)] for x, y in rng.integers((-1, -1), (12, 9), (degree // 2, 2))]
        rows.append([float(x) for x in product(*factors, *[[1, int(rng.integers(0, 4))]] * (degree % 2))])
    rows.append([0.0, *rows[0][1:]])
    rows.append([np.nan, *rows[0][1:]])
    c = np.array(rows)
    found, motion = classify(list(c.T)), find_motion(list(c.T))
    for k, row in enumerate(rows[:-2]):
        exact = [Fraction(x) for x in row]
        assert CLASSES[found.kind[k]] == curves.kind(exact)
        assert found.real_roots[k] == sum(curves.sturm(exact))
    assert found.kind[-2:].tolist() == [0, 0]
    assert np.isnan(motion.abscissa[-2:]).all()


def test_a_chart_of_a_cubic_is_that_of_the_routh_condition():
    """s³ + a s² + b s + 1: stable where a b > 1, a, b > 0; heavily damped where a² b² − 4 b³ − 4 a³ + 18 a b > 27 too."""
    of = model(("a", "b"), 3, lambda a, b: [1, a, b, 1])
    problem = Problem(model=of, free={"a": (-1.0, 7.0), "b": (-1.0, 7.0)}, title="cubics")
    found = chart(problem, points=(41, 31), boundaries=False)
    a, b = np.meshgrid(*found.grid)
    stable = (a > 0) & (a * b > 1)
    discriminant = a**2 * b**2 - 4 * b**3 - 4 * a**3 + 18 * a * b - 27
    clear = (np.abs(a * b - 1) > 1e-9) & (np.abs(discriminant) > 1e-9)
    assert np.array_equal((found.kind >= CLASSES.index("stable"))[clear], stable[clear])
    heavy = found.kind == CLASSES.index("heavily damped")
    assert np.array_equal(heavy[clear], (stable & (discriminant > 0))[clear])
    assert np.array_equal((found.real_roots == 3)[clear], (discriminant > 0)[clear])
    assert "heavily damped" in found.report()
    assert len(chart_figure(found, "real_roots").axes) == 2


def test_growth_of_a_model_without_speed():
    """s² + c s + 1 over c: stable for c > 0, heavily damped for c > 2."""
    of = from_coefficients([1, "c", "k"])
    design = solve(Problem(model=of, fixed={"k": 1.0}, free={"c": (-1.0, 5.0)}, minimize="(c - 2)**2"))
    data = growth(design)
    assert data.over.name == "c"
    assert (data.values[0], data.values[-1]) == (-1.0, 5.0)
    assert data.stable == (pytest.approx((0.0, 5.0), abs=1e-12),)
    assert data.heavily_damped == ((2.0, 5.0),)
    assert np.isnan(data.critical)
    assert len(growth_figure(data, "title").axes) == 2


def test_the_instant_bound_of_a_high_power_of_one_parameter():
    """s² + 2 s + 2 + T8(x): the product of the roots is 3 at most, at the ends and at x = cos(kπ/4), 1 at least."""

    def chebyshev(x):
        y = x * x
        return 128 * y**4 - 256 * y**3 + 160 * y**2 - 32 * y + 1

    of = model(("x",), 2, lambda x: [1, 2, 2 + chebyshev(x)])
    problem = Problem(model=of, free={"x": (-0.95, 0.95)}, minimize="abscissa")
    assert omega0_bound(problem.posed, -1.0).value <= -np.sqrt(3) * (1 - 1e-12)
    steep = model(("x",), 2, lambda x: [1, 2, 2 + chebyshev(x) * chebyshev(x)])
    problem = Problem(model=steep, free={"x": (-0.95, 0.95)}, minimize="abscissa")
    assert omega0_bound(problem.posed, -1.0).value <= -np.sqrt(3) * (
        1 - 1e-12
    )  # too high a degree to fit: never above it
