"""Formulates the optimum over the designs with a pattern by the Jordan chains of their matrices."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tmsopt.algebra.formula import symbol
from tmsopt.chains import ExceptionalPoint, Target
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.problem.dependence import needs_two_sided_bounds
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import Builder, default_start
from tmsopt.program.kinks import epigraph_form
from tmsopt.program.nlp import NLP, scale_of
from tmsopt.program.starts import initial_point
from tmsopt.program.subspaces import covered_cases, default_count, find_spectra, start_subspaces
from tmsopt.records import Array
from tmsopt.roots.chains import Chain, expand, size_at


def formulate_chains(
    problem: Posed, targets: Sequence[Target], point: ExceptionalPoint, extra: int = 0
) -> tuple[NLP, Array]:
    """Optimise the objective, or the distance to the start, with the chains as variables; and the start at a point.

    The equations Σ L_i x_(j−i) = 0 with the Taylor coefficients L_i of the matrix polynomial, and c* x_j constant, are
    polynomials in the eigenvalues and the vectors x_j.

    Args:
        extra: number of eigenvalues that the subspaces of the abscissa have in addition to `default_count`.
    """
    x, design, degree = list[float](), dict(zip(problem.free, point.p.tolist(), strict=True)), problem.model.degree
    counts = [min(default_count(degree) + extra, degree)] * len(covered_cases(problem.cases))
    has_subspaces = problem.model.polynomial is None and problem.asks("abscissa")
    spectra = find_spectra(problem, design, problem.cases, scale_of(problem).unit, counts) if has_subspaces else []
    build = Builder(problem, problem.cases, counts=[len(one.eigenvalues) for one in spectra])
    *_, parameters = build.values[0].given
    assert problem.model.pencil is not None
    assert problem.pattern is not None
    pencil = [np.array(P, dtype=object) for P in problem.model.pencil(problem.parameter_set.native(parameters))]
    roots = list[Pair]()
    for target, chain in zip(targets, point.chains, strict=True):
        root, values = _add_chain(build, problem.pattern.name, target, chain, pencil)
        roots.append(root)
        x += values
    build.add_constraints()
    if problem.objective is not None:
        build.add_objective()
    else:
        build.minimise_distance(default_start(problem))
    if spectra and counts[0] < degree:  # a subspace of all eigenvalues has these too, and a second limit is degenerate
        for root in roots:
            build.add_row("abscissa", root.re - build.quantities["abscissa"], -np.inf, 0.0)
    nlp = epigraph_form(build.finish("chains"), needs_two_sided_bounds(problem))
    if spectra:
        nlp = start_subspaces(nlp, problem, spectra)
    return nlp, initial_point(nlp, problem, design, is_near=True, known=x)


def _add_chain(
    build: Builder, name: str, target: Target, chain: Chain, pencil: Sequence[Any]
) -> tuple[Pair, list[float]]:
    """Add an eigenvalue and its chain; return the eigenvalue, and the values of both at the point."""
    is_complex = build.problem.model.is_complex
    is_real = target.is_real(is_complex)
    size, values = size_at(np.array([chain.terms[0], chain.terms[0]]), 0.0), list[float]()

    def add(value: complex, directions: Sequence[complex]) -> Pair:
        """A number whose value may change in some directions of the plane."""
        variables = {d: build.add_variable(name) for d in directions}
        values.extend(float(value.real if d == 1 else value.imag) for d in directions)
        return Pair(variables.get(1, 0), variables.get(1j, 0))

    def constant(value: complex) -> Pair:
        """A number of this point; the formula is the same for all points, so it is compiled once."""
        names = [f"chain {len(build.numbers) + k}" for k in range(2)]
        build.numbers = {**build.numbers, **dict(zip(names, (value.real, value.imag), strict=True))}
        return Pair(symbol(names[0])) if is_real else Pair(*map(symbol, names))

    plane = (1,) if is_real else (1, 1j)
    s = add(complex(chain.s), target.directions)
    vectors = chain.right * chain.powers[:, None] / np.linalg.norm(chain.right[0])
    if is_real:
        vectors = (vectors * vectors[0, np.abs(vectors[0]).argmax()].conj()).real
        vectors = vectors / np.linalg.norm(vectors[0])
    X = [np.array([add(complex(z), plane) for z in row], dtype=object) for row in vectors]
    terms = expand([np.vectorize(pair, otypes=[object])(P) for P in pencil], s, target.order)
    c = np.array([constant(complex(z)) for z in vectors[0].conj()], dtype=object)
    units = [constant(chain.unit**i / size) for i in range(len(terms))]
    for j in range(target.order):
        residual = sum((terms[i] @ X[j - i]) * units[i] for i in range(min(j + 1, len(terms))))
        normal = c @ X[j] - constant(complex(vectors[0].conj() @ vectors[j]))
        for equation in (*residual, normal):
            for part in (equation.re, equation.im)[: len(plane)]:
                build.add_row(name, part, 0.0, 0.0)
    return s, values
