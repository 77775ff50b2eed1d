"""What a multiple root is: its multiplicities and Jordan chains, and how its parts move when a parameter changes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np

from tmsopt.arithmetic.elementary import exact
from tmsopt.design.files import Given
from tmsopt.diagnosis.jordan import Jordan, is_regular, jordan
from tmsopt.diagnosis.splitting import DEVIATION, Ideal, Law, Response, response
from tmsopt.models import Model, ParameterSet
from tmsopt.models.told import eigenfrequencies, roots_told
from tmsopt.progress import Listener, counted
from tmsopt.records import Shown, plain
from tmsopt.roots import Root, Structure, backward_error
from tmsopt.roots.patterns.enclosed import nearest_roots
from tmsopt.solver.solve import solved_first

_BITS = 424  # 127 digits: changes down to 1e-16 are differences of coefficients
_RANK = 1e-7  # relative singular value that counts as 0; of a nearly semisimple root it is the root of the distance
_TIMES = 10.0  # likewise, times the root of the distance from the structure


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
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
                | {"unmoved": r.unmoved, "laws": [_law(law) for law in r.laws]}
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
    solution = solved_first(design, progress)
    counted(progress, "splitting roots")
    problem = solution.problem
    parameters = solution.worst.applied(solution.parameters) if solution.worst else dict(solution.parameters)
    values, told = problem.values(parameters), solution.of_polynomial
    found = values["structure"]
    assert isinstance(found, Structure)
    if found.name != told.name:  # the doubles stand a little aside, to keep a limit
        z = np.array([complex(r.re, r.im) for r in told.roots for _ in range(r.multiplicity)])
        found = replace(told, distance=float(backward_error([float(c) for c in values.coefficients], z)))
    return diagnosed(problem.model, problem.parameter_set, parameters, found, problem.free)


def diagnosed(
    model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure,
    free: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Diagnosis, ...]:  # fmt: skip
    """The same for any design of a model whose roots have a structure; free = ranges beside which it may be 0."""
    if all(root.multiplicity == 1 for root in structure.roots):
        return ()
    with flint.ctx.workprec(_BITS):
        ideal = _ideal(model, of, design, structure)
        return tuple(
            _diagnosis(model, of, design, structure, ideal, place, {n: b - a for n, (a, b) in (free or {}).items()})
            for place, (root, _) in enumerate(ideal)
            if root.multiplicity > 1 and (root.im >= 0 if model.carrier is None else root.im < 0)
        )


def _ideal(model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure) -> Ideal:
    coefficients = model.coefficients({n: exact(x) for n, x in design.items()}, of)
    balls = nearest_roots(structure.name, coefficients, structure.roots)
    if balls is None:
        return [(r, flint.acb(r.re, r.im)) for r in structure.roots]
    middles = [flint.acb(z.re.mid(), z.im.mid()) for z in balls]
    return [(Root(float(m.real), float(m.imag), z.multiplicity), m) for z, m in zip(balls, middles, strict=True)]


def _diagnosis(
    model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure, ideal: Ideal, place: int,
    widths: Mapping[str, float],
) -> Diagnosis:  # fmt: skip
    root, s = ideal[place]
    k = root.multiplicity
    ranks = _ranks(model, of, design, structure.distance, s, k)
    partial = ranks.partial if ranks else (k,)
    geometric = ranks.geometric if ranks else 1
    kind = "semisimple" if geometric == k else "defective" if geometric == 1 else "partly defective"
    responses = (response(model, of, design, ideal, place, name, widths.get(name, 0.0)) for name in of.names)
    ordered = tuple(sorted(responses, key=_sensitivity))
    (shown,) = roots_told(model, [Root(root.re, root.im, k)])
    omega = tuple(complex(z.re, z.im) for z in eigenfrequencies(model, [shown]))
    return Diagnosis(
        shown.re, shown.im, k, geometric, partial, kind, ranks, structure.distance, ordered, *omega
    )  # fmt: skip


def _ranks(
    model: Model, of: ParameterSet, design: Mapping[str, float], distance: float, s: Any, k: int,
) -> Jordan | None:  # fmt: skip
    """Jordan structure by the matrices; None without them, or if they are singular for every s."""
    if model.pencil is None:
        return None
    matrices = model.pencil(of.native({n: flint.arb(x) for n, x in design.items()}))
    threshold = max(_RANK, _TIMES * math.sqrt(distance))
    return jordan(matrices, s, k, threshold) if is_regular(matrices, s, threshold) else None


def _sensitivity(response: Response) -> tuple[float, float]:
    first = response.laws[0].branches if response.laws else None
    return (float(first.exponent), -first.size) if first else (math.inf, 0.0)


def _law(law: Law) -> dict[str, Any]:
    b = law.branches
    return {
        "roots": b.roots,
        "exponent": str(b.exponent),
        **plain(b, "numerator denominator constants size", digits=6),
        "holds": plain(law, "below above", digits=6) | {"deviation": DEVIATION},
    }
