"""An exceptional point has one eigenvector: crossings with more are none, and the search goes on.

The truth is known by a closed form: symmetric and Hermitian matrices are never defective; blocks that are written down
are what they are. What is found is judged by the eigenvectors that NumPy computes: beside an EPk they are parallel.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from benchmarks.suites.statements.case import Answer, Case

_PARALLEL = 1e4
"""Condition of the eigenvectors within 1e-8 of an EP2; of a diabolic point it is near 1."""

System = Callable[[Mapping[str, float]], Any]


def _none(answer: Answer) -> str:
    """What is false of an answer where no exceptional point exists."""
    if answer.status == 0:
        return "something is called found"
    text = answer.stdout
    if "none found" not in text and "infeasible" not in text:
        return f"headline: {text.splitlines()[1]}"
    told = "coincide" not in text or "not an EP" in text
    return "" if told else "it does not say what the crossing is"


def _found(answer: Answer, system: System) -> str:
    data = answer.data
    if data["status"] != "optimal":
        return f"{data['status']}, though there is one"
    if not (data["defective"] is True and data["geometric_multiplicity"] == 1):
        return "it is not called defective"
    _, vectors = np.linalg.eig(np.array(system(data["parameters"]), dtype=complex))
    condition = np.linalg.cond(vectors)
    return "" if condition > _PARALLEL else f"eigenvectors are independent: condition {condition:.3g}"


def _refuted(answer: Answer) -> str:
    data = answer.data
    if data["proved"]:
        return "an EP is proved where there is none"
    return "" if "not an EP" in data["reason"] else f"why: {data['reason']}"


def _proved(answer: Answer) -> str:
    data = answer.data
    defective = data["defective"]["holds"] is True and data["geometric_multiplicity"] == 1
    return "" if data["proved"] and defective else f"not proved defective: {data['reason']}"


def _listed(answer: Answer) -> str:
    data = answer.data
    if data["solutions"]:
        return "a crossing is listed"
    return "" if data["coverage"]["crossings"] else "the crossing is not told from other singular points"


def _partial(answer: Answer) -> str:
    text = answer.stdout
    if "(EP4)" in text and "not an EP4" not in text:
        return "two blocks of two are called EP4"
    return "" if answer.status == 0 else f"status {answer.status}"


def _cannot_tell(answer: Answer) -> str:
    return "" if "coefficients cannot tell" in answer.stdout else "coefficients are said to tell"


def _text(model: str, free: str, pattern: str) -> dict[str, str]:
    asked = f'[objective]\nlocate = "{pattern}"\n' if pattern else ""
    return {"problem.toml": f"[model]\n{model}\n[parameters]\n{free}\n{asked}"}


def _box(*names: str, low: float = -1, high: float = 1) -> str:
    return "\n".join(f"{name} = {{ min = {low}, max = {high} }}" for name in names)


def _quadratic(K: Any) -> Any:
    """The companion matrix of I s² + K."""
    n = len(K)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.array(K, dtype=float), np.zeros((n, n))]])


_I = "M = [[1, 0], [0, 1]]\n"
_NONE = (
    ("real symmetric H", 'H = [["d", "k"], ["k", "-d"]]', _box("d", "k"), "EP2"),
    ("Hermitian H", 'H = [["d", "1j*k"], ["-1j*k", "-d"]]', _box("d", "k", low=-2, high=1), "EP2"),
    ("symmetric A", 'A = [["d", "k"], ["k", "-d"]]', _box("d", "k"), "EP2"),
    ("symmetric A with an offset", 'A = [["d - 0.3", "k - 1"], ["k - 1", "0.3 - d"]]', _box("d", "k", high=2), "EP2"),
    (
        "two equal rotors",
        'M = [[1, 0], [0, "m"]]\nD = [[0.2, 0], [0, 0.2]]\nK = [["k", 0], [0, 1]]',
        _box("m", "k", low=0.5, high=3),
        "CEP2",
    ),
    ("two coupled pendulums", _I + 'K = [["1 + x", "y"], ["y", "1 - x"]]', _box("x", "y", low=-0.4, high=0.5), "CEP2"),
    (
        "the same, damped alike",
        _I + 'D = [[0.1, 0], [0, 0.1]]\nK = [["1 + x", "y"], ["y", "1 - x"]]',
        _box("x", "y", low=-0.5, high=0.4),
        "CEP2",
    ),
    ("a block of two and one alone", 'A = [["a", 1, 0], [0, 0, 0], [0, 0, "b"]]', _box("a", "b"), "EP3"),
    ("lossy diagonal H", 'H = [["d - 0.5j", 0], [0, "1j*k - 0.5j"]]', _box("d", "k", high=0.4), "EP2"),
)
_FOUND: tuple[tuple[str, str, str, str, System], ...] = (
    (
        "lines of EP2 through a diabolic point, A",
        'A = [["d", "k"], ["-k", "-d"]]',
        _box("d", "k"),
        "EP2",
        lambda p: [[p["d"], p["k"]], [-p["k"], -p["d"]]],
    ),
    (
        "the same in H",
        'H = [["d", "k"], ["-k", "-d"]]',
        _box("d", "k"),
        "EP2",
        lambda p: [[p["d"], p["k"]], [-p["k"], -p["d"]]],
    ),
    (
        "PT-symmetric dimer",
        'H = [["1j*g", 1.25], [1.25, "-1j*g"]]',
        _box("g", low=0.1, high=3),
        "EP2",
        lambda p: [[1j * p["g"], 1.25], [1.25, -1j * p["g"]]],
    ),
    (
        "one-way coupling",
        'H = [["a", 0.001], [0, "1j*b"]]',
        _box("a", "b"),
        "EP2",
        lambda p: [[p["a"], 0.001], [0, 1j * p["b"]]],
    ),
    (
        "a block of three",
        'A = [["a - 1", 1, 0], [0, -1, 1], [0, 0, "b - 1"]]',
        _box("a", "b"),
        "EP3",
        lambda p: [[p["a"] - 1, 1, 0], [0, -1, 1], [0, 0, p["b"] - 1]],
    ),
    (
        "onset of flutter",
        _I + 'K = [[1, "p"], ["-p", 2]]',
        _box("p", low=0.1, high=1),
        "CEP2",
        lambda p: _quadratic([[1, p["p"]], [-p["p"], 2]]),
    ),
)

CASES: tuple[Case, ...] = (
    *(
        Case(
            f"no EP: {name}", _text(model, free, pattern), ("solve", "problem.toml"), _none, "normal or block diagonal"
        )
        for name, model, free, pattern in _NONE
    ),
    *(
        Case(
            f"an EP: {name}",
            _text(model, free, pattern),
            ("solve", "problem.toml", "--json"),
            partial(_found, system=system),
            "closed form; eigenvectors by NumPy",
        )
        for name, model, free, pattern, system in _FOUND
    ),
    Case(
        "prove a diabolic point",
        _text('H = [["d", "k"], ["k", "-d"]]', "d = 0\nk = 0", ""),
        ("prove", "problem.toml", "--json"),
        _refuted,
        "H = 0 has two eigenvectors",
    ),
    Case(
        "prove a semisimple pair",
        _text(_I + 'K = [["k", 0], [0, "k"]]', "k = 2", ""),
        ("prove", "problem.toml", "--json"),
        _refuted,
        "K is a multiple of the identity",
    ),
    Case(
        "prove a block of two",
        _text('A = [["a", 1], [0, "a"]]', "a = -0.7", ""),
        ("prove", "problem.toml", "--json"),
        _proved,
        "in Jordan form",
    ),
    Case(
        "prove the onset of flutter",
        _text(_I + 'K = [[1, "p"], ["-p", 2]]', "p = 0.5", ""),
        ("prove", "problem.toml", "--json"),
        _proved,
        "K has one eigenvector at its double eigenvalue 3/2",
    ),
    Case(
        "all EP2 of a symmetric H",
        _text('H = [["d", "k"], ["k", "-d"]]', _box("d", "k"), "EP2"),
        ("solve", "problem.toml", "--all", "--seconds", "1", "--json"),
        _listed,
        "symmetric",
    ),
    Case(
        "least abscissa of two equal oscillators",
        {
            "problem.toml": '[model]\nM = [[1, 0], [0, 1]]\nD = [["c", 0], [0, "c"]]\nK = [[1, 0], [0, 1]]\n'
            '[parameters]\nc = { min = 0.1, max = 4 }\n[objective]\nminimize = "abscissa"\n'
        },
        ("solve", "problem.toml"),
        _partial,
        "c = 2: -1 is 4-fold with two blocks of two",
    ),
    Case(
        "coefficients",
        _text('coefficients = [1, "c", 1]', _box("c", low=0, high=3), "EP2"),
        ("solve", "problem.toml"),
        _cannot_tell,
        "diag(-1, -1) and its block of two have one polynomial",
    ),
)
