"""A stated system with a controller, B, C and G, against matrices closed by NumPy."""

import numpy as np
import pytest

import tmsopt

RNG = np.random.default_rng(22)
ENOUGH = 1e-12  # of coefficients: some hundred roundings of products near 1


def lists(matrix):
    return np.asarray(matrix).tolist()


@pytest.mark.parametrize(("n", "inputs", "measured"), [(2, 1, 2), (3, 2, 1), (4, 4, 4)])
def test_first_order(n, inputs, measured):
    A, B, C, G = (RNG.normal(size=s) for s in ((n, n), (n, inputs), (measured, n), (inputs, measured)))
    named = lists(G)
    named[0][0] = "k"
    model = tmsopt.models.from_matrices(A=lists(A), B=lists(B), C=lists(C), G=named)
    expected = np.poly(A - B @ G @ C)
    assert np.allclose(
        model.coefficients({"k": float(G[0, 0])}), expected, rtol=0, atol=ENOUGH * np.abs(expected).max()
    )


@pytest.mark.parametrize(("n", "inputs"), {1: 1, 2: 1, 3: 2}.items())
@pytest.mark.parametrize("damped", [True, False])
def test_second_order(n, inputs, damped):
    K, D, B, G = (RNG.normal(size=s) for s in ((n, n), (n, n), (n, inputs), (inputs, 2 * n)))
    M = 2 * np.eye(n)
    if not damped:
        D = 0 * D
    named = lists(G)
    named[-1][-1] = "k"
    given = {"D": lists(D)} if damped else {}
    model = tmsopt.models.from_matrices(M=lists(M), **given, K=lists(K), B=lists(B), G=named)
    closed = D + B @ G[:, n:], K + B @ G[:, :n]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, closed[1]), -np.linalg.solve(M, closed[0])]])
    expected = 2.0**n * np.poly(A)
    found = model.coefficients({"k": float(G[-1, -1])})
    assert np.allclose(found, expected, rtol=0, atol=ENOUGH * np.abs(expected).max())
    _, *closed_pencil = model.pencil({"k": float(G[-1, -1])})
    assert np.allclose(np.array(closed_pencil, dtype=float), closed, rtol=0, atol=ENOUGH * 10)


def test_a_file_states_it(tmp_path):
    """A pendulum held upright: s² + kd s + kp − a has its double root at −√(kp − a) for kd = 2 √(kp − a)."""
    path = tmp_path / "upright.toml"
    path.write_text(
        '[model]\nM = [["1"]]\nK = [["-a"]]\nB = [["1"]]\nG = [["kp", "kd"]]\n'
        "[parameters]\na = 9.0\nkp = { min = 0, max = 25 }\nkd = { min = 0, max = 20 }\n"
        '[objective]\nminimize = "abscissa"\n'
    )
    design = tmsopt.solve(path)
    assert design.structure == "EP2"
    assert design.abscissa == pytest.approx(-4.0, abs=1e-12)
    assert design.parameters["kd"] == pytest.approx(8.0, abs=1e-12)
    assert tmsopt.prove(design).proved


@pytest.mark.parametrize(
    ("given", "key", "said"),
    [
        ({"B": [[1], [0]]}, "G", "missing"),
        ({"G": [["k", 0]]}, "B", "missing"),
        ({"B": [[1]], "G": [["k", 0]]}, "B", "accepted: 2"),
        ({"B": [[1], [0]], "G": [["k"]]}, "G", "1 × 1; accepted: 1 × 2"),
        ({"B": [[1], [0]], "G": [["k"]], "C": [[1]]}, "C", "accepted: 2"),
        ({"B": [[1], [0, 1]], "G": [["k", 0]]}, "B", "rows of equal length"),
        ({"B": [[1], [0]], "G": [["k", float("nan")]]}, "G", "row 1, column 2"),
    ],
)
def test_what_does_not_fit(given, key, said):
    with pytest.raises(tmsopt.models.Unfit) as caught:
        tmsopt.models.from_matrices(A=[["a", 1], [0, 1]], **given)
    assert caught.value.key == key
    assert said in caught.value.message
