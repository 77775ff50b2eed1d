"""Models that a user states, in a file or in CasADi: what they make, what they refuse, and that all verbs take them."""

import keyword
import pickle
from fractions import Fraction
from functools import partial

import casadi as ca
import numpy as np
import pytest
from helpers.texts import faults, load, write
from matplotlib.mathtext import MathTextParser
from scipy.optimize import differential_evolution

import tmsopt
from tmsopt.models import CONSTANTS, FUNCTIONS, TAKEN, Unfit, from_coefficients, from_matrices, latex
from tmsopt.problem import ROOT_NAMES

PENDULUMS = """
[model]
name = "coupled pendulums"
M = [["m1*l1**2 + I1", "0"], ["0", "m2*l2**2 + I2"]]
D = [["c1 + c12", "-c12"], ["-c12", "c2 + c12"]]
K = [["k1", "-k12"], ["-k12", "k2"]]

[model.quantities]
ratio = "k1/k2"

[parameters]
m1 = 1
l1 = 1
I1 = 0.2
m2 = 2
l2 = 0.8
I2 = 0.1
c12 = 0.1
k12 = 0.7
k1 = { min = 1, max = 5 }
k2 = 3
c1 = { min = 0, max = 10 }
c2 = { min = 0, max = 10 }

[objective]
minimize = "abscissa"

[constraints]
stiffness = "ratio <= 1.4"
"""

PARAMETERS = "\n[parameters]\nk = { min = 1, max = 2 }\n"

k, c = ca.SX.sym("k"), ca.SX.sym("c")


def eigenvalues(M, D, K):
    """Roots of det(M s² + D s + K) as eigenvalues of the first companion form."""
    n = len(M)
    return np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    )


# What they make


def test_pendulums_of_a_file_are_solved(tmp_path):
    """The optimum is not beaten by differential evolution on NumPy's eigenvalues, and is met by it to 1e-7."""
    problem = load(tmp_path, PENDULUMS)
    design = tmsopt.solve(problem)

    def matrices(k1, c1, c2):
        M = np.diag([1 * 1**2 + 0.2, 2 * 0.8**2 + 0.1])
        return M, np.array([[c1 + 0.1, -0.1], [-0.1, c2 + 0.1]]), np.array([[k1, -0.7], [-0.7, 3]])

    own = [design.parameters[n] for n in ("k1", "c1", "c2")]
    roots = eigenvalues(*matrices(*own))
    # A double root moves by the square root of 1e-15, the rounding of the coefficients.
    assert roots.real.max() == pytest.approx(design.abscissa, abs=3e-7)
    assert design.structure == "EP2+pair"
    assert design.quantities["ratio"] == pytest.approx(1.4, abs=1e-9)
    found = differential_evolution(
        lambda x: eigenvalues(*matrices(4.2, *x)).real.max(), [(0, 10)] * 2, seed=1, popsize=8, tol=1e-10
    )
    assert found.fun == pytest.approx(design.abscissa, abs=1e-7)
    assert found.fun >= design.abscissa - 3e-7


@pytest.mark.parametrize("size", [1, 2, 3, 6])
def test_coefficients_of_matrices_are_those_of_numpy(size):
    random = np.random.default_rng(size)
    M, D, K, A = *random.normal(size=(3, size, size)), random.normal(size=(2 * size, 2 * size))
    second, first = from_matrices(M, ca.DM(D) * c, ca.DM(K) * k), from_matrices(A=ca.DM(A) * k)
    at = {"k": 1.3, "c": 0.7}
    for model, expected, pencil in (
        (second, np.poly(eigenvalues(M, 0.7 * D, 1.3 * K)) * np.linalg.det(M), (M, 0.7 * D, 1.3 * K)),
        (first, np.poly(1.3 * A), (np.eye(2 * size), -1.3 * A)),
    ):
        found = np.array(model.coefficients(at), dtype=float)
        # NumPy's inverse of M loses its condition, a few hundred here, of 16 digits.
        assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()
        assert np.allclose(np.array([*map(np.array, model.pencil(at))], dtype=float), pencil, rtol=1e-15)


def test_a_model_is_pickled_as_what_it_is():
    model = from_matrices([[1]], [[c]], [[k]], quantities={"ratio": c / k})
    assert pickle.loads(pickle.dumps(model)) is model
    assert from_matrices([[1]], [[c]], [[k]], quantities={"ratio": c / k}) is model
    problem = tmsopt.Problem(model=model, fixed={"k": 1}, free={"c": (0, 1)}, minimize="abscissa")
    assert pickle.loads(pickle.dumps(problem)) == problem


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.0, 2.0]),
        [np.array([1.0, 0]), (0, np.int64(2))],
        ca.DM([[1, 0], [0, 2]]),
        ca.diag(ca.SX([1, 2])),
        [[Fraction(1), 0], [0, Fraction(2)]],
        np.array([[1, 0], [0, ca.SX(2)]], dtype=object),
    ],
)
def test_matrices_of_any_kind(matrix):
    """det(diag(1, 2) s² + k I) = 2 s⁴ + 3 k s² + k²."""
    model = from_matrices(matrix, None, [[k, 0], [0, k]])
    assert [float(x) for x in model.coefficients({"k": 3.0})] == [2, 0, 9, 0, 9]


@pytest.mark.parametrize(
    ("lead", "degree"),
    [
        (ca.sqrt(1 - k), 2),
        (ca.fmax(0, k - 10), 2),
        (ca.log(k - 100), 2),
        (k - c, 2),
        (ca.fmax(0, k - 1e30), 2),
        (ca.fmin(0, c + 1e30), 2),  # 0 at every size that one would try
        (k - k, 1),
        ((k + c) ** 2 - k * k - 2 * k * c - c * c, 1),
        (ca.sin(k) ** 2 + ca.cos(k) ** 2 - 1, 1),
        (ca.sqrt(k) ** 2 - k, 1),
        (0.1 * k + 0.2 * k - 0.3 * k, 1),
        (ca.fabs(k - c) ** 4 - (k - c) ** 4, 1),
        (k * k**-1 - 1, 1),
        (ca.exp(k / c) - ca.exp(2 * k / (2 * c)), 1),
        (ca.sqrt(ca.cos(k) ** 2) ** 2 + ca.sin(k) ** 2 - 1, 1),
    ],
)
def test_a_leading_coefficient_is_left_out_only_where_it_is_nought_for_all(lead, degree):
    assert from_coefficients([lead, 1, k + c]).degree == degree


def test_singular_mass_matrices():
    """Singular in decimals, though not in binary; and a mass without inertia, coupled by a lever of length c."""
    model = from_matrices([[0.1, 0.7], [0.3, 2.1]], [[k, 0], [0, 1]], [[1, 0], [0, k]])
    # By hand: 0.1 + 2.1 k; 0.1 k + 2.1 + k; k² + 1; k.
    assert [float(x) for x in model.coefficients({"k": 2.0})] == pytest.approx([4.3, 4.3, 5, 2], rel=1e-15)
    with pytest.raises(Unfit, match="without s"):
        from_matrices([[0]], None, [[k]])
    lever = from_matrices([[k, k / c], [k / c, k / c**2]], None, [[1, 0], [0, k]])
    assert [float(x) for x in lever.coefficients({"k": 2.0, "c": 4.0})] == pytest.approx([2 * 2 + 2 / 16, 0, 2])


def test_quantities_may_use_one_another_and_stand_in_entries(tmp_path):
    problem = load(
        tmp_path,
        """
[model]
coefficients = ["1", "2*z*w", "w**2"]
[model.quantities]
half = "z/2"
z = "c/(2*w)"
w = "sqrt(k)"
[parameters]
c = 3
k = 4
""",
    )
    values = problem.posed.values({"c": 3.0, "k": 4.0})
    assert problem.model.sets[0].names == ("c", "k")
    assert [float(values[n]) for n in ("w", "z", "half", "a1", "a2")] == [2, 0.75, 0.375, 3, 4]


def test_numbers_of_a_model_are_told_apart_in_full():
    """CasADi prints six digits."""
    first, second = (from_coefficients([1, (1 + x) * k, 1]) for x in (1e-9, 2e-9))
    assert first.statement != second.statement
    long = [from_coefficients([1, ca.sin(sum((k + j) ** 2 for j in range(40)) + x), 1]) for x in (0, 1e-12)]
    assert long[0].statement != long[1].statement
    assert from_matrices([[1]], None, [[k]]).statement != from_coefficients([1, k]).statement


@pytest.mark.parametrize(
    ("name", "symbol"),
    {
        "a1": "a_{1}",
        "gamma": r"\gamma",
        "beta1": r"\beta_{1}",
        "mu_r": r"\mu_{r}",
        "W": "W",
        "k_max": r"k_{\mathrm{max}}",
        "m_1_a_b": "m_{1,a,b}",
        "lambda_": r"\lambda",
        "x__1": "x_{1}",
        "CamelCase": r"\mathrm{CamelCase}",
        "rho10b": r"\mathrm{rho10b}",
        "I1": "I_{1}",
    }.items(),
)
def test_names_as_symbols(name, symbol):
    assert latex(name) == symbol
    MathTextParser("agg").parse(f"${symbol}$")  # raises on what a figure could not show


# What they refuse


def test_no_name_is_taken_twice():
    assert {*ROOT_NAMES, *FUNCTIONS, *CONSTANTS} <= {*TAKEN}


@pytest.mark.parametrize(
    ("statement", "line", "said"),
    [
        ("M = 3\nK = [['k']]", 2, "model.M: found 3; accepted: rows in brackets"),
        ("M = [['1', '0'], ['0']]\nK = [['k', 0], [0, 'k']]", 2, "model.M: found rows of 2 + 1 entries"),
        ("K = [['k']]\nM = [[]]", 3, "model.M: found []"),
        ("M = [[1]]\nK = [['k', 0], [0, 1]]", 3, "model.K: is 2 × 2, but M is 1 × 1"),
        ("M = [[nan]]\nK = [['k']]", 2, "model.M: row 1, column 1: found nan"),
        ("M = [[true]]\nK = [['k']]", 2, "found True"),
        (f"M = [[1{'0' * 400}]]\nK = [['k']]", 2, "accepted: a finite number"),
        ("coefficients = ['1', '1/0', 'k']", 2, "entry 2: '1/0' divides by 0; accepted: parts with"),
        ("coefficients = ['1', 'sqrt(-1)', 'k']", 2, "entry 2: 'sqrt(-1)' is nan"),
        ("coefficients = ['1', '1/(k - k)', 'k']", 2, "entry 2: '1/(k - k)' contains inf"),
        ("coefficients = ['1', '10**400*k']", 2, "entry 2"),
        ("coefficients = ['1']", 2, "found 1 entries; accepted: a list of 2 to 13"),
        (f"coefficients = [{', '.join(14 * ['1'])}]", 2, "found 14 entries"),
        ("coefficients = [[1, 'k']]", 2, "entry 1: found [1, 'k']"),
        (f"M = {[[1] * 51] * 51}\nK = {[['k'] * 51] * 51}", 2, "is 51 × 51; accepted: up to 50 × 50"),
        (f"A = {[['k'] * 101] * 101}", 2, "is 101 × 101; accepted: up to 100 × 100"),
        ("A = [['k']]\nM = [[1]]", 2, "together with M, D or K"),
        ("M = [[1]]", 1, "model.K: is missing"),
        ("name = 'x'", 1, "states no system"),
        ("m = [[1]]\nK = [['k']]", 2, "unknown key 'm'; did you mean 'M'?"),
        ("name = 'tms'\ncoefficients = [1, 'k']", 2, "'tms' is a built-in model"),
        ("name = '''a\nb'''\ncoefficients = [1, 'k']", 2, "accepted: a text of one line"),
        ("coefficients = [1, 'k', 'exp(-s*tau)']", 2, "entry 3: 's' is the eigenvalue"),
        ("A = [['s*k', 1], [0, 'k']]", 2, "cannot treat a delay exp(-s*tau)"),
        ("A = [0, 1, '-k', '-c']", 2, "write [[0, 1], ['-k', '-c']]"),
        ("coefficients = 's**2 + k'", 2, "by descending powers of s"),
        ("coefficients = [1, 'cosh(k)']", 2, "write (exp(x) + exp(-x))/2"),
        ("coefficients = [1, 'k(t)']", 2, "cannot treat a system that changes with time"),
        ("coefficients = [1, 'lambda + k']", 2, "'lambda' is a reserved word, write e.g. lambda_"),
        ("coefficients = [1, 'abscissa + k']", 2, "'abscissa' is what tmsopt computes"),
        ("coefficients = [1, 'tanh(k)']", 2, "calls 'tanh'; write 1 - 2/(exp(2*x) + 1); accepted: sin"),
        ("coefficients = [1, 'k <= 2']", 2, "is a comparison"),
        ("coefficients = [1, '2']", 2, "names no parameter"),
        ("coefficients = [1, 'k']\nquantities.pi = 'k'", 3, "'pi' is what tmsopt computes"),
        ("coefficients = [1, 'k']\nquantities.in = 'k'", 3, "'in' is a reserved word"),
        ("coefficients = [1, 'k']\nquantities.q = ''", 3, "'' does not parse"),
        ("coefficients = [1, 'k']\nquantities.q = 3", 3, "found 3; accepted: an expression in quotes"),
        ("coefficients = [1, 'k']\nquantities.q = 'q2'\nquantities.q2 = 'q + 1'", 3, "uses itself: q → q2 → q"),
        ("coefficients = [1, 'k']\nquantities.q = 'k/(1 - 1)'", 3, "'k/(1 - 1)' divides by 0"),
    ],
)
def test_a_statement_that_makes_no_model_is_placed(tmp_path, statement, line, said):
    found = next(t for t in faults(tmp_path, f"[model]\n{statement}\n{PARAMETERS}") if said in t)
    assert found.startswith(f"{line}: model")


@pytest.mark.parametrize(
    ("model", "said"),
    {
        "model = 'nonsense'": "unknown model 'nonsense'",
        "model = 3": "found 3; accepted: the name of a model",
        "[[model]]\nname = 'x'": "accepted: the name of a model in quotes, or a table",
        "model = 'tms'\n[model]\nname = 'x'": "not TOML",
    }.items(),
)
def test_what_is_no_model(tmp_path, model, said):
    assert any(said in found for found in faults(tmp_path, model + PARAMETERS))


def test_lines_below_matrices_of_several_lines(tmp_path):
    """A row of a matrix may look like a header, and a text in it like a key."""
    text = """[model]
M = [
    ["1", "0"],
    ["0", "1"]   # [
]
note = '''
K = 1
[parameters]'''
K = [["k", "0"],
    ["0", "sin(k"]]
[parameters]
k = 1
"""
    found = [text.split(": ")[:2] for text in faults(tmp_path, text)]
    assert found == [["6", "model.note"], ["9", "model.K"]]


stiff = partial(from_matrices, [[1]], None)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: from_matrices(ca.MX.eye(2), None, [[k]]), "M: found MX"),
        (lambda: stiff([[ca.MX.sym("k")]]), "found MX; accepted: SX"),
        (lambda: from_matrices([[b"1"]], None, [[k]]), "row 1, column 1: found b'1'"),
        (lambda: from_matrices([[None]], None, [[k]]), "found None"),
        (lambda: from_matrices([[10**400]], None, [[k]]), "is inf"),
        (lambda: stiff([[k * np.inf]]), "contains inf"),
        (lambda: from_matrices(1, None, k), "M: found int; accepted: a matrix"),
        (lambda: from_matrices(np.zeros((2, 2, 2)), None, [[k]]), "found an array of 3 dimensions"),
        (lambda: from_matrices([[ca.SX.sym("x", 2)]], None, [[k]]), "is a matrix; accepted: scalar"),
        (lambda: stiff([[k + ca.SX.sym("k")]]), "two symbols named k"),
        (lambda: stiff([[ca.SX.sym("k 1")]]), "'k 1', which is no name"),
        (lambda: stiff([[ca.SX.sym("radius")]]), "which is what tmsopt computes"),
        (lambda: stiff([[k]], quantities={"k": k}), "'k' is the name of a parameter"),
        (lambda: stiff([["sin"]]), "K: row 1, column 1: 'sin' names the function"),
        (lambda: stiff([[k]], quantities=[k]), "quantities: found list"),
        (lambda: from_coefficients("1k"), "coefficients: found no list"),
        (lambda: from_coefficients(np.eye(2)), "coefficients: found no list"),
        (lambda: from_coefficients([1, ca.atan2(k, c)]), "entry 2: uses atan2"),
        (lambda: from_coefficients([1, ca.if_else(k > 0, k, c)]), "entry 2: uses"),
    ],
)
def test_expressions_that_make_no_model(make, said):
    with pytest.raises(Unfit) as caught:
        make()
    assert said in str(caught.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.key, str(again)) == (caught.value.key, str(caught.value))


def test_no_parameter_is_a_reserved_word():
    for word in keyword.kwlist:
        with pytest.raises(Unfit, match="reserved word"):
            from_coefficients([1, ca.SX.sym(word)])


# That all verbs take them


def test_parameters_named_like_coefficients(tmp_path):
    """The parameter or quantity keeps the name, and a chart is of the true coefficients."""
    problem = load(
        tmp_path,
        """
[model]
coefficients = ["1", "a1 + 1", "a2", "a3"]
quantities.a0 = "2*a1"
[parameters]
a1 = { min = 1, max = 3 }
a2 = { min = 2, max = 4 }
a3 = 0.5
""",
    )
    chart = tmsopt.chart(problem, points=(3, 3))
    expected = [[np.roots([1, x + 1, y, 0.5]).real.max() for x in (1, 2, 3)] for y in (2, 3, 4)]
    assert np.allclose(chart.abscissa, expected, rtol=1e-12)
    values = problem.posed.values({"a1": 1.0, "a2": 2.0, "a3": 0.5})
    assert [float(values[n]) for n in ("a0", "a1", "coefficient0", "coefficient1")] == [2, 1, 1, 2]


def test_one_root(tmp_path, run):
    """m s + a: the abscissa −a/m is least at a = 2 with m a = 1, and nothing is asked of pairs that are not there."""
    text = """
[model]
coefficients = ["m", "a"]
[parameters]
m = { min = 0.25, max = 1 }
a = { min = -1, max = 2 }
[objective]
minimize = "abscissa"
[constraints]
product = "m*a >= 1"
"""
    file = write(tmp_path, text)
    design = tmsopt.solve(tmsopt.load(file))
    assert design.abscissa == pytest.approx(-4, abs=1e-9)
    assert "makes it unstable (divergence)" in run("solve", file)[1]
    assert run("prove", file)[0] == 0


def test_coefficients_without_a_value_somewhere(tmp_path):
    """s² + s/x + 1 has its EP2 at x = 1/2; the box holds the pole x = 0 in its middle."""
    text = "[model]\ncoefficients = [1, '1/x', 1]\n[parameters]\nx = {{ min = {}, max = 1 }}\n[objective]\nminimize = 'abscissa'"
    for least in (0, -1):
        design = tmsopt.solve(load(tmp_path, text.format(least)))
        assert (design.structure, design.parameters["x"]) == ("EP2", pytest.approx(0.5, abs=1e-12))


def test_coefficients_without_a_value_anywhere(tmp_path, run):
    text = "[model]\ncoefficients = [1, 'sqrt(x)', 1]\n[parameters]\nx = { min = -2, max = -1 }\n[objective]\nminimize = 'abscissa'"
    code, out, _ = run("solve", write(tmp_path, text))
    assert code == 3
    assert "violated: coefficients (must have values)" in out
    assert "a coefficient has no value at this design" in out


@pytest.mark.parametrize("size", [1e6, 1e-6])
def test_roots_of_any_size(tmp_path, size):
    """s³ + x s² + y s + ω³: EP3 at −ω, x = 3 ω, y = 3 ω²."""
    problem = tmsopt.Problem(
        model=from_coefficients([1, ca.SX.sym("x"), ca.SX.sym("y"), size**3 * ca.SX.sym("z")]),
        fixed={"z": 1},
        free={"x": (0, 10 * size), "y": (0, 10 * size**2)},
        minimize="abscissa",
    )
    design = tmsopt.solve(problem)
    assert design.structure == "EP3"
    assert design.parameters["x"] / size == pytest.approx(3, rel=1e-11)
    assert design.abscissa / size == pytest.approx(-1, rel=1e-11)


def test_small_roots_of_a_stiff_system_are_not_called_double():
    """(s² + c s + 2)(1e-8 s² + d s + 1e8): double where c² = 8, and not 8e-5 off that, whatever the fast roots are."""
    d = ca.SX.sym("d")
    model = from_matrices([[1, 0], [0, 1e-8]], [[c, 0], [0, d]], [[2, 0], [0, 1e8]])
    problem = tmsopt.Problem(model=model, fixed={"c": 1, "d": 6})
    for off in (1e-4, 1e-8):
        slow = np.sqrt(8) * (1 + off)
        found = problem.posed.values({"c": slow, "d": 6.0})["structure"]
        assert found.name == "real"
        assert found.abscissa == pytest.approx(-slow / 2 + np.sqrt(slow**2 / 4 - 2), abs=1e-7)


def test_a_study_is_not_gone_on_with_after_the_model_changed(tmp_path, run):
    own = "[model]\ncoefficients = [1, 'x', '{}*y']\n[parameters]\nx = {{ min = 0, max = 9 }}\ny = 1\n[objective]\nminimize = 'abscissa'"
    study = write(tmp_path, "problem = 'problem.toml'\n[study]\nmethod = 'grid'\n[vary]\ny = [1, 4]\n", "study")
    for written_as, status in (("1", 0), ("1.000000001", 2)):
        write(tmp_path, own.format(written_as))
        code, out, err = run("study", study, "--store", tmp_path / "rows.sqlite")
        assert code == status, err
    assert 'coefficients[0][2]: "y" in the store, "(1.000000001 * y)" in the file' in out + err


def test_a_chart_is_not_gone_on_with_after_the_model_changed(tmp_path, run):
    own = "[model]\ncoefficients = [1, 'x', 'y', '{}']\n[parameters]\nx = {{ min = 0, max = 9 }}\ny = {{ min = 0, max = 9 }}"
    folder = tmp_path / "plane.chart"
    for written_as, status in (("1", 0), ("1", 0), ("1.0000001", 2)):
        code, out, err = run("chart", write(tmp_path, own.format(written_as)), "--points", "20", "--output", folder)
        assert code == status, err
    assert '"1.0000001"' in out + err


def test_axes_beside_layers_of_the_same_name(tmp_path):
    problem = tmsopt.Problem(model=from_coefficients([1, ca.SX.sym("kind"), c]), free={"kind": (1, 9), "c": (0, 9)})
    found = tmsopt.chart(problem, points=(2, 2), layers=["kind"], boundaries=False)
    found.save(tmp_path / "plane.npz")
    with np.load(tmp_path / "plane.npz") as data:
        assert data["parameter.kind"].tolist() == [1, 9]
        assert data["kind"].shape == (2, 2)


def test_matrices_take_the_texts_that_a_file_takes():
    """The same model as by symbols; texts and symbols may stand side by side."""
    mu, w, c = (ca.SX.sym(n) for n in ("mu", "w", "c"))
    damper, spring = [["c", "-c"], ["-c", "c"]], [["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]
    at, k = {"mu": 0.1, "c": 0.05, "w": 0.9}, mu * w**2
    by_symbols = from_matrices([[1, 0], [0, mu]], [[c, -c], [-c, c]], [[1 + k, -k], [-k, k]])
    for mass, zeta in ((mu, c / (2 * mu * w)), ("mu", "c/(2*mu*w)")):
        model = from_matrices([[1, 0], [0, mass]], damper, spring, quantities={"half": "zeta/2", "zeta": zeta})
        assert model.coefficients(at) == pytest.approx(by_symbols.coefficients(at), rel=1e-15)
        half = tmsopt.Problem(model, fixed=at).posed.values(at)["half"]
        assert half == pytest.approx(0.05 / (4 * 0.1 * 0.9), rel=1e-15)
