"""Diagnoses a multiple root: its multiplicities, its Jordan chains, and how it splits when a parameter changes."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np

from tmsopt.analysis.root_point import RootPoint, evaluate_pencil, high_precision, midpoint, refine_point, refine_root
from tmsopt.analysis.sensitivity import measure_sensitivity, sensitivity_to_json
from tmsopt.analysis.splitting import DEVIATION, Law, Response, compute_chain_response, compute_response
from tmsopt.chains import family_of
from tmsopt.models import Model, ParameterSet
from tmsopt.models.user_spectrum import eigenfrequencies
from tmsopt.problem.evaluate import evaluate_matrices
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import matrices_at
from tmsopt.problem.real_form import has_real_form
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Complex, Numbers, Printable, plain
from tmsopt.roots import Root, Structure, backward_error
from tmsopt.roots.chains import Chain, eigenvalues_of, find_borders, make_chain
from tmsopt.roots.jordan import Jordan, is_regular, jordan
from tmsopt.search.solve import solve_if_needed

_ROUNDED_ZERO = 1e-12  # a value of at most this share of its range may be a rounded 0
_ZERO_SINGULAR_VALUE = 1e-7  # largest relative singular value that counts as 0
_DISTANCE_FACTOR = 10.0  # the same in units of √distance, the size of such values near a semisimple root


@dataclass(frozen=True, repr=False)
class Diagnosis(Printable):
    """A multiple root of a design, or the upper root of a multiple complex pair.

    Attributes:
        re, im: the root.
        algebraic: algebraic multiplicity.
        geometric: number of independent eigenvectors; 1 for a polynomial without matrices.
        partial: lengths of the Jordan chains, longest first; empty if the computed ranks contradict each other.
        kind: ``defective`` for one chain, ``semisimple`` for chains of length 1, ``partly defective`` otherwise.
        jordan: the singular values from which `kind` follows; None if the model has no matrices, or matrices that are
            singular for every s.
        distance: relative change of the coefficients from the design to the nearest polynomial with the structure.
        responses: one response for each parameter; the parameter that moves the root most comes first.
        eigenfrequency: ω = i s for a complex system, otherwise None.
        phase_rigidity, petermann, condition: the sensitivity, as in `Eigenvalues`: 0 and infinite unless semisimple.

    Example:
        >>> (found,) = tmsopt.diagnose("problems/ep4.toml")
        >>> found.kind, found.algebraic, found.geometric, found.partial  # one Jordan chain of four
        ('defective', 4, 1, (4,))

    More: docs/explanation/exceptional_points.md
    """

    re: float
    im: float
    algebraic: int
    geometric: int
    partial: tuple[int, ...]
    kind: str
    jordan: Jordan | None
    distance: float
    responses: tuple[Response, ...]
    eigenfrequency: complex | None = None
    phase_rigidity: float = 0.0
    petermann: float = math.inf
    condition: float = math.inf

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; descriptive numbers have 6 digits."""
        return {
            **plain(self, "re im"),
            **(plain(self, "eigenfrequency") if self.eigenfrequency is not None else {}),
            **plain(self, "algebraic geometric partial kind"),
            **sensitivity_to_json(self),
            "matrices": self.jordan is not None,
            **({"singular_values": plain(self.jordan, "zero nonzero threshold", digits=6)} if self.jordan else {}),
            **plain(self, "distance", digits=6),
            "responses": [
                {"parameter": r.parameter, "change": "relative" if r.relative else "absolute"}
                | {"unmoved": r.unmoved, "unresolved": r.unresolved, "laws": [_law_to_json(law) for law in r.laws]}
                for r in self.responses
            ],
        }


def diagnose(design: ProblemSource, *, progress: Listener | None = None) -> tuple[Diagnosis, ...]:
    """Diagnose every multiple root of a design, rightmost first; empty if all roots are simple.

    The structure of the solution gives the algebraic multiplicity. Ranks of the model's matrices, at the root of the
    nearest polynomial with that structure, give the geometric and partial multiplicities. The splitting follows from
    the exact change of that polynomial with a parameter: s = s0 + (c ε)^(1/k) with c = −k! ∂p/∂θ / p⁽ᵏ⁾, or, if c is 0,
    from Newton's polygon. The computed roots confirm each law.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        progress: called with a `tmsopt.Progress` now and then.

    Example:
        >>> (pair,) = tmsopt.diagnose("problems/pt_pair.toml")  # Bender et al. (2013): s² = -(1 - 0.1²/2), twice
        >>> f"{pair.im**2:.6f}", pair.algebraic, pair.geometric
        ('0.995000', 2, 1)

    More: docs/explanation/exceptional_points.md
    """
    solution = solve_if_needed(design, progress)
    start_steps(progress, "splitting roots")
    problem = solution.problem.posed
    parameters = solution.worst.applied(solution.parameters) if solution.worst else dict(solution.parameters)
    structure = Structure(solution.structure, solution.roots, 0.0)
    if not has_real_form(problem.model):
        return tuple(_diagnose_chains(problem, parameters, structure))
    values = problem.values(parameters)
    structure_at_design = values["structure"]
    assert isinstance(structure_at_design, Structure)
    # to satisfy a limit, the stored parameters may differ slightly from those at which the roots are multiple
    if structure_at_design.name != structure.name and not problem.model.is_complex:
        z = np.array([complex(r.re, r.im) for r in structure.roots for _ in range(r.multiplicity)])
        structure_at_design = replace(
            structure, distance=float(backward_error([float(c) for c in values.coefficients], z))
        )
    has_size = problem.model.pencil is not None and problem.free
    least = family_of(problem).typical_size if has_size and problem.model.is_complex else 0.0
    return diagnose_roots(problem.model, problem.parameter_set, parameters, structure_at_design, problem.free, least)


def diagnose_roots(
    model: Model,
    parameter_set: ParameterSet,
    design: Numbers,
    structure: Structure,
    free: Mapping[str, tuple[float, float]] | None = None,
    least: float = 0.0,
) -> tuple[Diagnosis, ...]:
    """Diagnose the multiple roots of a design whose roots have a known structure.

    Args:
        least: lower limit of the unit of eigenvalues, see `jordan`.
        free: ranges of free parameters. A value that is tiny compared with its range may be a rounded 0.
    """
    matrices = evaluate_matrices(model, parameter_set, design).astype(complex)
    range_widths, diagnoses = {n: b - a for n, (a, b) in (free or {}).items()}, []
    if not has_real_form(model):
        return ()

    def find_chains(point: RootPoint) -> Jordan | None:
        """The Jordan chains, by ranks of the matrices; None without matrices, or if they are singular for every s."""
        if model.pencil is None:
            return None
        matrices = evaluate_pencil(model, parameter_set, point.values)
        threshold = max(_ZERO_SINGULAR_VALUE, _DISTANCE_FACTOR * math.sqrt(structure.distance))
        if not is_regular(matrices, point.s, threshold):
            return None
        return jordan(matrices, point.s, point.multiplicity, threshold, least)

    with high_precision():
        for root in structure.roots:
            k = root.multiplicity
            if k == 1 or (root.im < 0 and not model.is_complex):
                continue
            stored_point = refine_root(model, parameter_set, design, range_widths, complex(root.re, root.im), k)
            stored_chains = find_chains(stored_point)
            point = refine_point(stored_point, stored_chains.geometric if stored_chains else 1)
            refined_chains, g = find_chains(point), point.geometric
            if refined_chains and refined_chains.zero > refined_chains.threshold:
                continue  # coefficients of a high degree do not separate some simple roots; the matrices do
            chains = (
                refined_chains
                if stored_chains and refined_chains and refined_chains.geometric == stored_chains.geometric
                else stored_chains
            )
            partial = chains.partial if chains else (k,)
            kind = "semisimple" if g == k else "defective" if g == 1 else "partly defective"
            responses = tuple(
                sorted((compute_response(point, name) for name in parameter_set.names), key=_rank_response)
            )
            s = midpoint(point.s)
            omega = next((complex(z.re, z.im) for z in eigenfrequencies(model, [Root(s.real, s.imag, k)])), None)
            sensitivity = measure_sensitivity(matrices, s, k, kind != "semisimple")
            diagnosis = Diagnosis(
                s.real, s.imag, k, g, partial, kind, chains, structure.distance, responses, omega, **sensitivity
            )
            diagnoses.append(diagnosis)
    return tuple(diagnoses)


def _diagnose_chains(problem: Posed, parameters: Numbers, structure: Structure) -> Iterator[Diagnosis]:
    """Diagnose the multiple eigenvalues of matrices without a polynomial, in doubles, to leading order."""
    model, parameter_set = problem.model, problem.parameter_set
    family = family_of(problem.derive(free={n: (x - 1, x + 1) for n, x in parameters.items()}, fixed={}))
    matrices, slopes = family.expand(np.array([*parameters.values()]))
    balls = evaluate_pencil(model, parameter_set, {n: flint.arb(x) for n, x in parameters.items()})
    for root in structure.roots:
        s, k = complex(root.re, root.im), root.multiplicity
        if k == 1 or (root.im < 0 and not model.is_complex):
            continue
        chains, responses = (
            jordan(balls, flint.acb(s), k, _ZERO_SINGULAR_VALUE),
            [Response(n, False, (), 0, k) for n in parameters],
        )
        if chains.geometric == 1:
            chain = make_chain(matrices, s, k, find_borders(matrices, s)[0])
            chain = make_chain(matrices, s, k, chain.borders)
            responses = [_respond(problem, parameters, chain, n, D) for n, D in zip(parameters, slopes, strict=True)]
        kind = "semisimple" if chains.geometric == k else "defective" if chains.geometric == 1 else "partly defective"
        yield Diagnosis(
            s.real,
            s.imag,
            k,
            chains.geometric,
            chains.partial,
            kind,
            chains,
            structure.distance,
            tuple(sorted(responses, key=_rank_response)),
            1j * s if model.is_complex else None,
            **measure_sensitivity(matrices, s, k, kind != "semisimple"),
        )


def _respond(problem: Posed, parameters: Numbers, chain: Chain, name: str, change: Complex) -> Response:
    """The response of an eigenvalue to one parameter, relative to its value unless this may be a rounded 0."""
    value, (low, high) = parameters[name], problem.free.get(name, (0.0, 0.0))
    relative = abs(value) > _ROUNDED_ZERO * (high - low)
    step = value if relative else 1.0
    return compute_chain_response(
        chain,
        name,
        relative,
        step * change,
        lambda e: eigenvalues_of(
            matrices_at(problem.model, problem.parameter_set, {**parameters, name: value + e * step})
        ),
    )


def _rank_response(response: Response) -> tuple[float, float]:
    fastest = response.laws[0].branches if response.laws else None
    return (float(fastest.exponent), -fastest.prefactor) if fastest else (math.inf, 0.0)


def _law_to_json(law: Law) -> dict[str, Any]:
    b = law.branches
    return {
        "roots": b.roots,
        "exponent": str(b.exponent),
        **plain(b, "numerator denominator constants", digits=6),
        **plain({"size": b.prefactor}, digits=6),
        "holds": plain(law, "least below above", digits=6) | {"deviation": DEVIATION},
    }
