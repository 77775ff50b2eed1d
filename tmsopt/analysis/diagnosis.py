"""What a multiple root is: its multiplicities and Jordan chains, and how its parts move when a parameter changes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tmsopt.analysis.meeting import Meeting, many_digits, met, middle, pencil_of, polished
from tmsopt.analysis.splitting import DEVIATION, Law, Response, response
from tmsopt.models import Model, ParameterSet
from tmsopt.models.user_spectrum import eigenfrequencies, user_roots
from tmsopt.problem.files import Given
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Numbers, Printable, plain
from tmsopt.roots import Root, Structure, backward_error
from tmsopt.roots.jordan import Jordan, is_regular, jordan
from tmsopt.search.solve import solve_if_needed

_RANK = 1e-7  # relative singular value that counts as 0; of a nearly semisimple root it is the root of the distance
_TIMES = 10.0  # likewise, times the root of the distance from the structure


@dataclass(frozen=True, repr=False)
class Diagnosis(Printable):
    """A multiple root of a design; of a complex pair, the one in the upper half-plane.

    Attributes:
        re, im: the root.
        algebraic: how many roots it stands for.
        geometric: number of independent eigenvectors; of a polynomial without matrices 1.
        partial: lengths of the Jordan chains, longest first; none if the ranks contradict each other.
        kind: ``defective`` for one chain, ``semisimple`` for chains of length 1, ``partly defective`` between.
        jordan: the singular values behind the verdict; None without matrices.
        distance: relative change of the coefficients from the design's to those with the structure.
        responses: most sensitive parameter first.
        eigenfrequency: of a complex system ω = i s.

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

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that only describe have 6 digits."""
        return {
            **plain(self, "re im"),
            **(plain(self, "eigenfrequency") if self.eigenfrequency is not None else {}),
            **plain(self, "algebraic geometric partial kind"),
            "matrices": self.jordan is not None,
            **({"singular_values": plain(self.jordan, "zero nonzero threshold", digits=6)} if self.jordan else {}),
            **plain(self, "distance", digits=6),
            "responses": [
                {"parameter": r.parameter, "change": "relative" if r.relative else "absolute"}
                | {"unmoved": r.unmoved, "unresolved": r.unresolved, "laws": [_law(law) for law in r.laws]}
                for r in self.responses
            ],
        }


def diagnose(design: Given, *, progress: Listener | None = None) -> tuple[Diagnosis, ...]:
    """Diagnosis of every multiple root of a design, rightmost first; none if all roots are simple.

    The algebraic multiplicity is that of the solution's structure. The geometric and partial multiplicities are ranks
    of the model's matrices at the root of the nearest polynomial with that structure. How the root splits follows from
    that polynomial with the exact changes of the coefficients that a parameter makes: c = −k! ∂p/∂θ / p⁽ᵏ⁾ of
    s = s0 + (c ε)^(1/k), or Newton's polygon where that vanishes; the law is then set beside the roots themselves.

    Args:
        design: a solution; or a problem or its file, solved first.
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
    values, told = problem.values(parameters), solution.of_polynomial
    found = values["structure"]
    assert isinstance(found, Structure)
    if found.name != told.name:  # the doubles stand a little aside, to keep a limit
        z = np.array([complex(r.re, r.im) for r in told.roots for _ in range(r.multiplicity)])
        found = replace(told, distance=float(backward_error([float(c) for c in values.coefficients], z)))
    return diagnosed(problem.model, problem.parameter_set, parameters, found, problem.free)


def diagnosed(
    model: Model,
    of: ParameterSet,
    design: Numbers,
    structure: Structure,
    free: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Diagnosis, ...]:
    """The same for any design of a model whose roots have a structure; free = ranges beside which it may be 0."""
    widths, found = {n: b - a for n, (a, b) in (free or {}).items()}, []

    def ranks(at: Meeting) -> Jordan | None:
        """Jordan structure by the matrices; None without them, or if they are singular for every s."""
        if model.pencil is None:
            return None
        matrices = pencil_of(model, of, at.values)
        threshold = max(_RANK, _TIMES * math.sqrt(structure.distance))
        return jordan(matrices, at.s, at.multiplicity, threshold) if is_regular(matrices, at.s, threshold) else None

    with many_digits():
        for root in user_roots(model, structure.roots):
            k = root.multiplicity
            if k == 1 or (root.im < 0 and model.double is None):
                continue
            stored = met(model, of, design, widths, complex(root.re, root.im), k)
            as_stored = ranks(stored)
            at = polished(stored, as_stored.geometric if as_stored else 1)
            exact, g = ranks(at), at.geometric
            verdict = exact if as_stored and exact and exact.geometric == as_stored.geometric else as_stored
            partial = verdict.partial if verdict else (k,)
            kind = "semisimple" if g == k else "defective" if g == 1 else "partly defective"
            ordered = tuple(sorted((response(at, name) for name in of.names), key=_sensitivity))
            s = middle(at.s)
            omega = (complex(z.re, z.im) for z in eigenfrequencies(model, [Root(s.real, s.imag, k)]))
            distance = structure.distance
            found.append(Diagnosis(s.real, s.imag, k, g, partial, kind, verdict, distance, ordered, *omega))
    return tuple(found)


def _sensitivity(response: Response) -> tuple[float, float]:
    first = response.laws[0].branches if response.laws else None
    return (float(first.exponent), -first.size) if first else (math.inf, 0.0)


def _law(law: Law) -> dict[str, Any]:
    b = law.branches
    return {
        "roots": b.roots,
        "exponent": str(b.exponent),
        **plain(b, "numerator denominator constants size", digits=6),
        "holds": plain(law, "least below above", digits=6) | {"deviation": DEVIATION},
    }
