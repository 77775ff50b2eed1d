"""Stated systems of degree 3 to 8 for hard problems: expressions as coefficients, matrices, feedback, roots at zero."""

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.suites.hard_frames import Frame, number, signed
from tmsopt.models import FUNCTIONS, from_coefficients, from_matrices

Entries = list[list[str]]
_SYMBOLIC: Mapping[str, Any] = {
    **{n: getattr(ca, n) for n in FUNCTIONS if hasattr(ca, n)},
    "abs": ca.fabs,
    "min": ca.fmin,
    "max": ca.fmax,
}
_TERMS = (
    "{c}*{x}",
    "{c}*{x}*{y}",
    "{c}*sin(2*{x})",
    "{c}*(exp({x}/2) - 1)",
    "{c}*{x}**2",
    "{c}*{x}/(1 + {y}**2)",
    "{c}*cos({x} + {y})",
    "{c}*{x}**2*{y}",
)


def system(
    matrices: Mapping[str, Entries],
    free: Mapping[str, tuple[float, float]],
    given: Mapping[str, float],
    rng: np.random.Generator,
) -> Frame:
    """A frame of matrices, or of coefficients in one row, as text."""
    texts = [text for rows in matrices.values() for row in rows for text in row]
    symbols = {n: ca.SX.sym(n) for n in (*given, *free)}
    used = {n for text in texts for n in compile(text, "entry", "eval").co_names} & set(symbols)
    made: dict[str, Any] = {
        n: [[eval(text, dict(_SYMBOLIC), symbols) for text in row] for row in rows] for n, rows in matrices.items()
    }
    model = (
        from_coefficients(made["coefficients"][0], name="hard")
        if "coefficients" in made
        else from_matrices(name="hard", **made)
    )
    fixed = {n: v for n, v in given.items() if n in used}
    return Frame(model, fixed, {n: b for n, b in free.items() if n in used}, rng)


def polynomial(rng: np.random.Generator, count: int, zero: bool = False, push: float = 0.0) -> Frame:
    """Coefficients that are expressions of the gains; with `zero` the last is 0, with `push` roots to the right."""
    degree = int(rng.integers(3, 9)) - zero
    names = [f"x{k}" for k in range(1, count + 1)]
    base = np.poly(_roots(rng, degree, push)).real
    text = [f"{number(float(a))}" for a in base]
    for name in names:
        for k in rng.choice(np.arange(1, degree + 1), min(degree, int(rng.integers(2, 4))), replace=False):
            text[k] += f" + {_term(rng, name, names, 0.5 * float(base[k]))}"
    if rng.random() < 0.3:
        text[0] = f"{text[0]} + {number(rng.uniform(0.1, 0.6))}*{names[0]}**2"
    return system({"coefficients": [[*text, "0"] if zero else text]}, _gains(rng, names), {}, rng)


def chain(rng: np.random.Generator, count: int, zero: bool = False, push: float = 0.0) -> Frame:
    """2 to 4 masses in a row, with a stiffness that bends, a gyroscopic and a follower term; or nothing holds it."""
    size = int(rng.integers(2, 5))
    M, D, K = ([["0"] * size for _ in range(size)] for _ in range(3))
    ranges: dict[str, tuple[float, float]] = {}

    def fresh(name: str, low: float, high: float) -> str:
        ranges[name] = (low, high)
        return name

    def between(matrix: Entries, text: str, i: int, j: int) -> None:
        for row, column, sign in ((i, i, "+"), (j, j, "+"), (i, j, "-"), (j, i, "-")):
            matrix[row][column] += f" {sign} {text}"

    for i in range(size):
        M[i][i] = fresh(f"m{i + 1}", 0.4, 4.0)
        D[i][i] = fresh(f"d{i + 1}", 0.0, 3.0) if i == 0 or rng.random() < 0.5 else "0"
        if not zero and (i == 0 or rng.random() < 0.3):
            K[i][i] += f" + {fresh(f'k{i + 1}', 0.3, 6.0)}"
    for i in range(size - 1):
        stiffness = fresh(f"s{i + 1}", 0.3, 6.0)
        between(K, f"{stiffness}*(1 + h**2)" if i == 0 else stiffness, i, i + 1)
        between(D, fresh(f"c{i + 1}", 0.0, 2.0), i, i + 1)
    fresh("h", -1.0, 1.0)
    D[0][1] += f" + {fresh('g', -1.5, 1.5)}"
    D[1][0] += " - g"
    if not zero:
        K[0][1] += f" + {fresh('n', -0.8, 0.8)}"
        K[1][0] += " - n"
    if push:
        D[size - 1][size - 1] += f" - {number(push)}"
    return _split(rng, count, {"M": M, "D": D, "K": K}, ranges)


def feedback(rng: np.random.Generator, count: int, zero: bool = False, push: float = 0.0) -> Frame:
    """A random plant of order 3 to 7 whose state matrix has gains; with `zero` an idle state."""
    size = int(rng.integers(3, 8)) - zero
    plant = rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.6) - (0.5 - push) * np.eye(size)
    text = [[f"{number(float(x))}" if x else "0" for x in row] for row in plant]
    names = [f"x{k}" for k in range(1, count + 1)]
    for name in names:
        for _ in range(2):
            i, j = (int(k) for k in rng.integers(size, size=2))
            text[i][j] += f" + {_term(rng, name, names, 1.0)}"
    if push:  # the trace stays where it is, so that the mean of the roots does
        text = [
            [t if i != j else f"{number(float(plant[i, j]))}" for j, t in enumerate(row)] for i, row in enumerate(text)
        ]
        text[0][1] += "".join(f" + {n}" for n in names)
    if zero:
        text = [[*row, "0"] for row in text] + [[f"{number(float(x))}" for x in rng.normal(size=size)] + ["0"]]
    return system({"A": text}, _gains(rng, names), {}, rng)


def _term(rng: np.random.Generator, name: str, names: list[str], size: float) -> str:
    factor = number(float(rng.uniform(0.3, 1) * rng.choice([-1, 1]) * size))
    return str(rng.choice(_TERMS)).format(c=signed(factor), x=name, y=rng.choice(names))


def _gains(rng: np.random.Generator, names: list[str]) -> dict[str, tuple[float, float]]:
    return {n: (number(-rng.uniform(0.8, 2.5), 2), number(rng.uniform(0.8, 2.5), 2)) for n in names}


def _split(
    rng: np.random.Generator, count: int, matrices: Mapping[str, Entries], ranges: Mapping[str, tuple[float, float]]
) -> Frame:
    names = {str(n) for n in rng.choice(list(ranges), min(count, len(ranges)), replace=False)}
    if not any(n[0] in "dc" for n in names):
        names = {*sorted(names)[1:], "c1"}
    given = {
        n: number(float(rng.uniform(lo + 0.1 * (hi - lo), lo + 0.6 * (hi - lo)))) for n, (lo, hi) in ranges.items()
    }
    free = {n: ends for n, ends in ranges.items() if n in names}
    return system(matrices, free, {n: v for n, v in given.items() if n not in names}, rng)


def _roots(rng: np.random.Generator, n: int, push: float) -> Any:
    pairs = [complex(push - rng.uniform(0.1, 1.5), rng.uniform(0.3, 2.5)) for _ in range(n // 2)]
    alone = [complex(push - rng.uniform(0.2, 2.0))] * (n % 2)
    return np.array([*(w for z in pairs for w in (z, z.conjugate())), *alone])
