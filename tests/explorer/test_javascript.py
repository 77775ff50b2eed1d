"""The numbers of the page, computed by Node, against the package's own, ball arithmetic and exact chains."""

import math
from fractions import Fraction
from itertools import count, islice

import flint
import numpy as np
import pytest
import scipy.linalg
from helpers.curves import sturm
from helpers.javascript import ask
from helpers.oracles import routh_exact
from helpers.places import PROBLEMS as FOLDER

from tmsopt.algebra import BALLS, exact
from tmsopt.explorer import model_script
from tmsopt.models import Values, from_coefficients, from_matrices
from tmsopt.problem import Problem, load
from tmsopt.roots import backward_error, classify, find_motion, roots

FILES = (
    "ep4 point_mass_robot whipple_ep4 whipple_benchmark brake_squeal pt_pair ziegler_undamped three_masses_pt chocolate "
    "two_mass_spring three_masses transport_aircraft"
)
DESIGNS = 2000
FEW = 300


def chain():
    """Six masses in a row with springs k, dampers c and a gyroscopic coupling g: degree 12."""
    n = 6
    K = [["2*k" if i == j else "-k" if abs(i - j) == 1 else "0" for j in range(n)] for i in range(n)]
    D = [["c" if i == j else f"{np.sign(j - i)}*g" if abs(i - j) == 1 else "0" for j in range(n)] for i in range(n)]
    M = [["1 + m" if i == j == 0 else str(int(i == j)) for j in range(n)] for i in range(n)]
    free = {"k": (0.1, 4.0), "c": (-0.1, 6.0), "g": (0.0, 2.0), "m": (-0.5, 5.0)}
    return Problem(from_matrices(M, D, K, name="six masses"), free=free, constraints={"stiff": "k - exp(-m) >= 0.1"})


def problem_of(name):
    return chain() if name == "chain" else load(FOLDER / f"{name}.toml")


def designs(problem, count, seed=0):
    """In the box, what is fixed varied by some percent within what is possible."""
    rng, of = np.random.default_rng(seed), problem.posed.parameter_set
    columns = []
    for p in of.parameters:
        low, high = problem.free.get(p.name) or sorted(problem.fixed[p.name] * np.array([0.95, 1.05]))
        columns.append(rng.uniform(max(low, p.range.lower), min(high, p.range.upper), count))
    return np.stack(columns, axis=1)


def python_coefficients(problem, x):
    of = problem.posed.parameter_set
    found = problem.model.coefficients(dict(zip(of.names, x.T, strict=True)), of)
    return np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in found)), axis=1)


def balls(problem, row, more=()):
    """Everything of a design in balls that allow for the rounding of each parameter, which sizes the terms of a sum."""
    of = problem.posed.parameter_set
    given = {n: flint.arb(float(v), abs(float(v)) * 2.0**-53) for n, v in zip(of.names, row, strict=True)}
    return Values(problem.model, of, given).with_known({name: exact(float(value)) for name, value in more})


def agree(found, ball, factor=1000):
    """Within so many roundings of the parameters, 1e-13 of the terms; what does not exist is not a finite number."""
    ball = flint.arb(ball)
    if not ball.is_finite():
        return True
    return abs(found - float(ball.mid())) <= factor * float(ball.rad()) + 1e-13 * abs(float(ball.mid())) + 1e-290


def motion_of(a):
    """Abscissae and damping ratios of rows of coefficients."""
    found = find_motion(list(a.T))
    return found.abscissa, found.damping_ratio


WHOLE = """(rows) => {
  const a = new Float64Array(MODEL.degree + 1), out = new Float64Array(3);
  return rows.map((x) => {
    MODEL.coefficients(Float64Array.from(x), a);
    motionOf(a, out);
    const { re, im } = rootsOf(a);
    return [Array.from(a), kindOf(a), Array.from(out), Array.from(re), Array.from(im)];
  });
}"""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FILES.split(), "chain"])
def test_designs_of_a_box_are_as_in_python(name):
    problem = problem_of(name)
    x = designs(problem, DESIGNS)
    found = ask(problem, WHOLE, x.tolist())
    a, kind, motion, re, im = (np.array([row[k] for row in found], dtype=float) for k in range(5))
    with flint.ctx.workprec(106):
        for row, c in zip(x, a, strict=True):
            expected = balls(problem, row).coefficients
            assert all(agree(one, exact(other)) for one, other in zip(c, expected, strict=True))
    assert np.array_equal(kind, classify(list(python_coefficients(problem, x).T)).kind)
    assert np.all(backward_error(a, re + 1j * im) <= JOINT)
    assert np.all(np.diff(re, axis=1) <= 0)
    assert np.array_equal(np.sort_complex(re + 1j * im), np.sort_complex(re - 1j * im))
    assert np.mean(check_motion(a, motion.T)) > 0.4


JOINT = 1e-13
"""Backward error that `tmsopt.roots.roots` keeps to, too."""


def distance(z):
    """How far roots with backward errors of 1e-14 may be off, 1e-12 of their size if more, to first order.

    And where first order tells, for roots that are far enough from one another.
    """
    size, n = np.abs(z), z.shape[1]
    apart = np.abs(z[:, :, None] - z[:, None, :])
    nearest = (apart + np.where(np.eye(n, dtype=bool), np.inf, 0)).min(axis=2)
    terms = np.prod(size[:, :, None] + size[:, None, :], axis=2)
    slope = np.prod(np.where(np.eye(n, dtype=bool), 1.0, apart), axis=2)
    with np.errstate(all="ignore"):
        off = 1e-14 * terms / slope
        judged = np.all(off < 1e-2 * nearest, axis=1)
    return np.maximum(off.max(axis=1), 1e-12 * size.max(axis=1)), judged


def check_motion(a, layers):
    """Abscissae, damping ratios and frequencies for rows of coefficients, where first order tells; and where it does."""
    z = roots(a)
    tolerance, judged = distance(z)
    units = 1.0, np.abs(z).min(axis=1), 1.0
    for found, expected, unit in zip(layers, (*motion_of(a), z.imag.max(axis=1)), units, strict=False):
        assert np.all(np.abs(found - expected)[judged] <= (2 * tolerance / unit)[judged])
    return judged


DERIVED = """(rows) => {
  const y = new Float64Array(100);
  return rows.map(([x, r]) => (MODEL.derived(Float64Array.from(x), r, y.fill(NaN)), Array.from(y)));
}"""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FILES.split(), "chain", "physical_machine", "realistic", "heavily_damped"])
def test_quantities_and_margins_are_those_of_ball_arithmetic(name):
    problem = problem_of(name)
    script = model_script(problem.posed)
    assert [*script.constraints] == [*problem.posed.conditions]
    x = designs(problem, FEW, seed=1)
    alpha, ratio = motion_of(python_coefficients(problem, x))
    frequency = roots(python_coefficients(problem, x)).imag.max(axis=1)
    motion = np.stack([alpha, ratio, frequency], axis=1)
    found = np.array(ask(problem, DERIVED, list(zip(x.tolist(), motion.tolist(), strict=True))), float)
    known = 0
    with flint.ctx.workprec(106):
        for row, r, y in zip(x, motion, found, strict=True):
            of_roots = dict(zip(("abscissa", "damping_ratio", "angular_frequency"), r, strict=True))
            values = balls(problem, row, of_roots.items())
            parameters = dict(zip(problem.posed.parameter_set.names, row.tolist(), strict=True))
            numbers = problem.posed.values(parameters).with_known(of_roots)
            for k, n in enumerate(script.quantities):
                expected = problem.posed.read(n).of(values, BALLS)
                known += bool(flint.arb(expected).is_finite())
                assert agree(y[k], expected), n
                plain = problem.posed.read(n)(numbers)
                assert math.isnan(y[k]) == math.isnan(plain), n
                assert math.isinf(y[k]) == math.isinf(plain), n
            for k, n in enumerate(script.constraints, start=len(script.quantities)):
                condition = problem.posed.conditions[n]
                sign = -1 if condition.comparison == "<=" else 1  # the margin is what is left of a limit
                assert agree(sign * y[k], condition.of(values, BALLS)), n
    assert known >= 0.5 * FEW * len(script.quantities)
    assert np.all(np.isnan(found[:, len(script.quantities) + len(script.constraints) :]))


def polynomials(degree):
    """Any polynomials of a degree whose coefficients are the parameters: what the page does with them alone."""
    names = [f"a_{k}" for k in range(degree + 1)]
    return Problem(from_coefficients(names, name=f"degree {degree}"), free=dict.fromkeys(names, (-1.0, 1.0)))


def product(factors):
    whole = [Fraction(1)]
    for factor in factors:
        whole = [
            sum((whole[i] * factor[k - i] for i in range(len(whole)) if 0 <= k - i < len(factor)), Fraction(0))
            for k in range(len(whole) + len(factor) - 1)
        ]
    return whole


FACTORS = ([1, 1], [1, 2], [1, -1], [1, 0], [2, 1], [1, 0, 1], [1, 0, 4], [1, 2, 2], [1, -2, 2], [1, 1, 1], [1, 0, -2])
"""Roots that are real, imaginary, right and left, 0; a product of them has them several times."""


def hard_cases(degree, seed):
    """Coefficients, exact as doubles, with roots on the boundaries, multiple roots, and those a rounding away from it."""
    rng, rows = np.random.default_rng(seed), []
    while len(rows) < FEW:
        chosen, left = [], degree
        while left:
            factor = FACTORS[rng.integers(len(FACTORS))]
            if len(factor) - 1 <= left:
                times = min(rng.integers(1, 4), left // (len(factor) - 1))
                chosen += [factor] * times
                left -= times * (len(factor) - 1)
        c = np.array([float(x) for x in product(chosen)]) * rng.choice([1.0, -1.0, 2.0**-40, 2.0**60])
        c *= 2.0 ** (rng.integers(-20, 20) * np.arange(degree + 1))
        rows.append(c)
        k, near = rng.integers(degree + 1), np.where(c == 0, 2.0**-90, np.abs(np.spacing(c))) * rng.choice([-1, 1])
        rows.append(np.where(np.arange(degree + 1) == k, c + near, c))
    rows += list(rng.normal(size=(FEW, degree + 1)))
    rows += [[0.0, *[1.0] * degree], [math.nan, *[1.0] * degree], [1.0] * degree + [math.inf], [1.0] + [0.0] * degree]
    rows += [np.poly(-np.arange(1.0, degree + 1))]  # whole numbers, exactly
    return np.array(rows)


def exact_class(c, is_stable):
    """Class code and number of real roots by independent exact chains; the verdict on stability is given."""
    if not np.all(np.isfinite(c)) or c[0] == 0:
        return 0, 0
    negative, zero, positive = sturm(c)
    kind = (4 if negative == len(c) - 1 else 3) if is_stable else 1 if zero + positive else 2
    return kind, negative + zero + positive


@pytest.mark.slow
@pytest.mark.parametrize("degree", range(1, 13))
def test_kinds_are_exact_beside_boundaries_and_exceptional_points(degree):
    rows = hard_cases(degree, seed=degree)
    answer = "(rows) => rows.map((a) => (a = Float64Array.from(a), [kindOf(a), realRootsOf(a)]))"
    found = np.array(ask(polynomials(degree), answer, rows.tolist()))
    stable = classify(list(rows.T)).kind >= 3  # up to degree 4 by rounded conditions, like the page
    if degree > 4:
        assert np.array_equal(stable, [np.all(np.isfinite(c)) and c[0] != 0 and routh_exact(c) for c in rows])
    assert np.array_equal(found, [exact_class(c, s) for c, s in zip(rows, stable, strict=True)])
    assert set(found[:, 0]) == ({0, 1, 4} if degree == 1 else {0, 1, 2, 3, 4})


MEETINGS = "(rows) => rows.map((a) => meetingsOf(rootsOf(Float64Array.from(a))))"


@pytest.mark.slow
@pytest.mark.parametrize(
    "expected",
    [
        [[-1, 0, 4]],
        [[0, 1, 2]],
        [[-1, 0, 2], [-3, 0, 2]],
        [[0, 0, 2], [-1, 0, 1], [-2, 0, 1]],
        [[-2, 0, 6]],
        [[-3, 0, 1]],
        [[-1, 2, 3], [-4, 0, 1]],
        [[-1, 1, 2], [-2, 0, 3]],
        [[1000, 0, 3], [-0.5, 0, 2]],
        [[-1, 0, 12]],
        [[-1, 0, 1], [-1 - 2.0**-10, 0, 1], [-5, 0, 1]],
    ],
)
def test_roots_that_meet_are_one_with_a_multiplicity(expected):
    roots_of = [complex(re, y) for re, im, times in expected for y in {im, -im} for _ in range(times)]
    c = np.poly(roots_of).real  # rounded, by which a multiple root comes apart
    scaled = c * 2.0 ** (7 * np.arange(len(c)) - 30)
    for row, unit in ((c, 1.0), (scaled, 2.0**7)):
        (found,) = ask(polynomials(len(c) - 1), MEETINGS, [row.tolist()])
        assert [m[2] for m in found] == [m[2] for m in expected]
        size = np.abs(roots_of).max()
        off = np.array(found)[:, :2] / unit - np.array(expected)[:, :2]
        # first order in the rounding: the mean of a cluster is well known
        assert np.max(np.abs(off)) < 1e-9 * max(size, 1)


@pytest.mark.slow
@pytest.mark.parametrize("degree", range(1, 13))
def test_roots_give_their_coefficients_back_wherever_they_meet(degree):
    rng, rows = np.random.default_rng(degree), []
    for m in [*range(1, degree + 1)] * 20:
        size = 10 ** rng.uniform(-3, 3, degree)
        real = np.where(np.arange(degree) < m, -abs(rng.normal()), rng.normal(size=degree)) * size[0]
        rows.append(np.poly(real * np.where(np.arange(degree) < m, 1.0, size)))
    pairs = rng.normal(size=(100, 2)) @ np.array([[1, 1], [1j, -1j]])
    rows += [np.poly([*np.tile(z, degree // 2), *[1.0] * (degree % 2)]).real for z in pairs]
    rows += list(rng.normal(size=(FEW, degree + 1)) * 10 ** rng.uniform(-8, 8, (FEW, degree + 1)))
    found = ask(
        polynomials(degree),
        "(rows) => rows.map((a) => rootsOf(Float64Array.from(a)))",
        np.array(rows).tolist(),
    )
    z = np.array([np.array(row["re"]) + 1j * np.array(row["im"]) for row in found])
    assert np.all(backward_error(np.array(rows), z) <= JOINT)
    # Judged in the page by bounds that are up to twice as large, or some roundings smaller.
    assert np.all(np.array([row["error"] for row in found]) <= JOINT)
    apart = rng.normal(size=(FEW, degree + 1))
    for row, meetings in zip(apart, ask(polynomials(degree), MEETINGS, apart.tolist()), strict=True):
        x, y, times = np.transpose(meetings)
        own = roots(row)
        assert np.all(times == 1)
        assert np.allclose(np.sort_complex(x + 1j * y), np.sort_complex(own[own.imag >= 0]), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["ep4", "whipple_benchmark", "point_mass_robot", "brake_squeal", "three_masses", "transport_aircraft", "chain"],
)
def test_responses_are_those_of_the_matrix_exponential(name):
    problem = problem_of(name)
    model, of = problem.model, problem.posed.parameter_set
    even, uneven = np.linspace(0.0, 20.0, 41), np.array([0.0, 0.1, 0.7, 0.70001, 3.0])
    answer = "([x, start, times]) => response(Float64Array.from(x), start, times)"
    for row in designs(problem, 5, seed=3):
        matrices = [np.array(m, dtype=float) for m in model.pencil(of.native(dict(zip(of.names, row, strict=True))))]
        A = -np.linalg.solve(matrices[0], matrices[1])
        if len(matrices) == 3:
            A = np.block([[np.zeros_like(A), np.eye(len(A))], [-np.linalg.solve(matrices[0], matrices[2]), A]])
        start = np.arange(1.0, len(A) + 1)
        for at in (even / np.linalg.norm(A), uneven / np.linalg.norm(A)):
            found = np.array(ask(problem, answer, [row.tolist(), start.tolist(), at.tolist()]))
            expected = np.array([scipy.linalg.expm(A * t) @ start for t in at])
            growth = np.array([np.linalg.norm(scipy.linalg.expm(A * t), 2) for t in at])[:, None]
            assert np.all(np.abs(found.reshape(expected.shape) - expected) <= 1e-10 * growth * np.linalg.norm(start))


@pytest.mark.slow
def test_response_of_a_singular_mass_does_not_exist():
    singular = Problem(from_matrices([["m", "0"], ["0", "1"]], None, [["1", "0"], ["0", "1"]]), free={"m": (0.0, 1.0)})
    answer = "(m) => response(Float64Array.of(m), [1, 0, 0, 0], [0, Math.PI])"
    assert ask(singular, answer, 0.0) is None
    assert np.allclose(np.reshape(ask(singular, answer, 1.0), (2, 4))[1], [-1, 0, 0, 0], atol=1e-10)
    assert ask(load(FOLDER / "chocolate.toml"), answer, 1.0) is None  # stated by its coefficients


SURVEY = """([x, i, j, xs, ys]) => survey(Float64Array.from(x), i, j, Float64Array.from(xs), Float64Array.from(ys), ["abscissa", "damping"])"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "file", ["ep4", "point_mass_robot", "whipple_ep4", "three_masses_pt", "two_mass_spring", "three_masses", "chain"]
)
def test_surveys_are_the_designs_one_by_one(file):
    problem = problem_of(file)
    names, free = problem.posed.parameter_set.names, [*problem.free]
    i, j = names.index(free[0]), names.index(free[1])
    xs, ys = (np.linspace(*problem.free[n], m) for n, m in zip(free[:2], (31, 23), strict=True))
    x = designs(problem, 1, seed=5)[0]
    found = ask(problem, SURVEY, [x.tolist(), i, j, xs.tolist(), ys.tolist()])
    every = np.repeat(x[None], len(xs) * len(ys), axis=0)
    every[:, i], every[:, j] = np.tile(xs, len(ys)), np.repeat(ys, len(xs))
    a = python_coefficients(problem, every)
    kind = classify(list(a.T)).kind
    assert np.array_equal(found["kind"], kind)
    layers = np.array([found["abscissa"], found["damping"]], dtype=float)
    assert np.all(np.isnan(layers[:, kind == 0]))
    check_motion(a[kind > 0], layers[:, kind > 0])


def test_hostile_names_and_every_function_of_the_language():
    names = ["constructor", "window", "MODEL", "x", "Math"]
    terms = ["1", "sin(constructor)", "max(window, MODEL, 2)**3 + x**0.5", "exp(Math)*atan(x) - abs(window)"]
    model = from_coefficients(terms, quantities={"alert": "min(x, Math)**(-1) + x**2.5", "eval": "log(x)/(x - 1)"})
    problem = Problem(
        model,
        free=dict.fromkeys(names, (0.1, 2.0)),
        constraints={"</script>": "alert <= 7", "eval": "eval <= 1", "far": "radius >= 0"},
    )
    script = model_script(problem.posed)
    assert (script.quantities, script.constraints) == (("alert", "eval"), ("</script>", "eval"))
    assert not any(n in script.text for n in ["constructor", "window", "script", "alert", "eval"])
    assert script.text.count("MODEL") == 1


UNARY = (
    "-({0})|abs({0})|sqrt(abs({0}))|sin({0})|cos({0})|atan({0})|exp(-abs({0}))|({0})**2|({0})**3|({0})**(-1)|"
    "abs({0})**1.5|log(1 + abs({0}))|tan(sin({0}))|asin(sin({0}))"
)
BINARY = "({0}) + ({1})|({0}) - ({1})|({0}) * ({1})|({0}) / ({1})|min({0}, {1})|max({0}, {1})"


@pytest.mark.slow
def test_random_expressions_have_the_values_that_python_computes():
    rng = np.random.default_rng(7)

    def written(depth):
        if depth == 0:
            return str(rng.choice(["u", "v", "w", "2", "0.5", "3.25", "1e-3"]))
        sides = written(depth - 1), written(int(rng.integers(depth)))
        chosen = f"{BINARY}|{UNARY}" if rng.random() < 0.6 else BINARY
        return str(rng.choice(chosen.split("|"))).format(*sides)

    def exists(text):
        try:
            return from_coefficients(["1", "u + v", "w"], quantities={"q": text})
        except ValueError as error:
            assert "divides by 0" in str(error)  # as by atan(w - w)
            return False

    drawn = filter(exists, (f"{written(5)} + 0*u" for _ in count()))
    texts = {f"q{k}": text for k, text in enumerate(islice(drawn, FEW))}
    model = from_coefficients(["1", "u + v", "w"], quantities=texts)
    problem = Problem(model, free=dict.fromkeys("uvw", (-2.0, 2.0)))
    x = designs(problem, 20)
    script = model_script(problem.posed)
    assert script.quantities == tuple(texts)
    answer = DERIVED.replace("100", str(FEW))
    found = np.array(ask(problem, answer, [[row, [0, 0, 0]] for row in x.tolist()]), dtype=float)
    with np.errstate(all="ignore"):
        values = dict(zip(problem.posed.parameter_set.names, x.T, strict=True))
        moved = {n: c * (1 + 2.0**-50) for n, c in values.items()}
        expected, near = (
            np.stack(np.broadcast_arrays(*(problem.posed.read(t)(v) for t in texts.values())), axis=1)
            for v in (values, moved)
        )
    found, expected, near = (np.where(np.isfinite(y), y, np.nan) for y in (found, expected, near))
    # By as much as a change of the last digits of the parameters moves them, where that is the condition.
    off = 1e-12 * np.abs(expected) + 1e3 * np.abs(near - expected)
    both = np.isfinite(expected) & np.isfinite(near)
    assert np.mean(both) > 0.9
    assert np.all(np.abs(found - expected)[both] <= off[both])
    assert np.array_equal(np.isfinite(found), np.isfinite(expected))
