"""All designs with a pattern in random polynomial systems: interval branch and prune beside a search."""

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np

from benchmarks.reports.tables import Asked, duration, page, table
from tmsopt import Every, Problem, solve_all
from tmsopt.models import from_coefficients

_ASKED = (
    (3, "EP3"),
    (4, "EP3"),
    (4, "CEP2"),
    (4, "2EP2"),
    (5, "EP3"),
    (5, "CEP2"),
    (6, "EP3"),
    (7, "EP3"),
    (8, "EP3"),
    (4, "EP4"),
)
"""Degree and pattern, with as many parameters as it has conditions."""

_SECONDS, _SHORT = 60.0, 5.0
_REACH = 2.0


@dataclass(frozen=True)
class _Row:
    degree: int
    pattern: str
    search: Every
    searching: float
    proof: Every


def _problem(index: int, seed: int) -> Problem:
    """A polynomial with stable roots, each coefficient but the first moved by a quadratic form in the parameters."""
    degree, pattern = _ASKED[index]
    rng = np.random.default_rng([seed, index, 11])
    roots = [-rng.uniform(0.5, 2.0) + 1j * rng.uniform(0.3, 2.0) for _ in range(degree // 2)]
    base = np.poly([*roots, *np.conj(roots), *([-rng.uniform(0.5, 2.0)] * (degree % 2))]).real
    names = [ca.SX.sym(f"x{k}") for k in range(1, 4 if pattern == "EP4" else 3)]
    row: list[ca.SX | float] = [1.0]
    for c in base[1:]:
        powers = [*names, *(a * b for k, a in enumerate(names) for b in names[k:])]
        row.append(round(float(c), 3) + sum(round(float(c * rng.normal() * 0.6), 3) * p for p in powers))
    return Problem(from_coefficients(row), free={n.name(): (-_REACH, _REACH) for n in names}, locate=pattern)


def _row(index: int, asked: Asked) -> _Row:
    problem = _problem(index, asked.seed)
    began = time.perf_counter()
    search = solve_all(problem, seconds=0)
    searching = time.perf_counter() - began
    proof = solve_all(problem, seconds=asked.within(_SECONDS, _SHORT))
    return _Row(*_ASKED[index], search, searching, proof)


def _cells(row: _Row) -> list[object]:
    found, proof = row.search.coverage, row.proof.completeness
    assert found is not None
    assert proof is not None
    all_of_them = len(proof.designs) if proof.complete else f"{len(proof.designs)} and more, if any: {proof.reason}"
    return [
        row.degree,
        row.pattern,
        len(row.search.solutions),
        found.starts,
        duration(row.searching),
        all_of_them,
        proof.boxes,
        duration(proof.seconds),
    ]


def report(asked: Asked) -> str:
    """The report in Markdown."""
    rows = [_row(index, asked) for index in range(min(asked.of(len(_ASKED), 2), len(_ASKED)))]
    header = ("degree", "pattern", "search: designs", "starts", "time", "proof: designs", "boxes", "time")
    about = (
        "Polynomials with stable roots, each coefficient but the first moved by a quadratic form in two parameters, of "
        f"EP4 in three, all in ±{_REACH:g}; seed {asked.seed}. The search is `solve_all(problem, seconds=0)`: Newton's "
        "method and IPOPT until each design was met three times and an estimate expects no more. The proof is interval "
        "branch and prune, which shows that there is no other design. A homotopy continuation was not run."
    )
    return page("All designs", asked, table(header, map(_cells, rows)), about)
