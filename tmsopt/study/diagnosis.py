"""What a multiple root is: its multiplicities and Jordan chains, and how its parts move when a parameter changes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import flint
import numpy as np

from tmsopt.design.solution import Solution
from tmsopt.models import Model, ParameterSet
from tmsopt.roots import Root, Structure, product
from tmsopt.roots.elementary import exact
from tmsopt.roots.enclosed import nearest
from tmsopt.roots.jordan import Jordan, is_regular, jordan
from tmsopt.roots.puiseux import Branches, branches

DEVIATION = 0.1
"""Share by which a root may be off the leading term while the law is said to hold."""

_BITS = 424  # 127 digits: changes down to 1e-20 are differences of coefficients
_RANK = 1e-7  # relative singular value that counts as 0; of a nearly semisimple root it is the root of the distance
_TIMES = 10.0  # likewise, times the root of the distance from the structure
_NOTHING = 1e-9  # of its terms: a derivative that vanishes at the exact multiple root, and not quite at the stored one
_FAINT = 1e-13  # of the coefficients' own terms: a derivative that rounding of the design alone may bring about
_DECADES = range(-16, 1)  # of the changes at which a law is tried
_WITHIN = (0.75, 0.5, 0.25)  # and, before the first decade at which it fails


@dataclass(frozen=True)
class Law:
    """Roots that leave the multiple root alike when a parameter changes.

    Attributes:
        branches: tᵠ = C εᵖ for the shift t of each, to leading order.
        below, above: |ε| up to which every sampled shift is within `DEVIATION` of it, for ε < 0 and ε > 0; sampled at
            each decade from 1e-16 to 1, and four times in the last one that is reached; 0 if it fails at 1e-16.
    """

    branches: Branches
    below: float
    above: float


@dataclass(frozen=True)
class Response:
    """How a multiple root answers to one parameter.

    Attributes:
        relative: whether ε is relative to the parameter's value; of a parameter that is 0 it is absolute.
        laws: fastest first; empty if no root moves.
        unmoved: roots that stay, to the orders looked at.
    """

    parameter: str
    relative: bool
    laws: tuple[Law, ...]
    unmoved: int


@dataclass(frozen=True)
class Diagnosis:
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

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that only describe have 6 digits."""
        ranks = self.jordan
        return {
            "re": self.re,
            "im": self.im,
            "algebraic": self.algebraic,
            "geometric": self.geometric,
            "partial": list(self.partial),
            "kind": self.kind,
            "matrices": ranks is not None,
            **({"singular_values": _singular(ranks)} if ranks else {}),
            "distance": _short(self.distance),
            "responses": [
                {
                    "parameter": r.parameter,
                    "change": "relative" if r.relative else "absolute",
                    "unmoved": r.unmoved,
                    "laws": [_law(law) for law in r.laws],
                }
                for r in self.responses
            ],
        }


def diagnose(solution: Solution) -> tuple[Diagnosis, ...]:
    """Diagnosis of every multiple root of a design, rightmost first; none if all roots are simple.

    The algebraic multiplicity is that of the solution's structure. The geometric and partial multiplicities are ranks
    of the model's matrices at the root of the nearest polynomial with that structure. How the root splits follows from
    that polynomial with the exact changes of the coefficients that a parameter makes: c = −k! ∂p/∂θ / p⁽ᵏ⁾ of
    s = s0 + (c ε)^(1/k), or Newton's polygon where that vanishes; the law is then set beside the roots themselves.
    """
    problem = solution.problem
    design = solution.worst.applied(solution.parameters) if solution.worst else dict(solution.parameters)
    found = problem.values(design)["structure"]
    assert isinstance(found, Structure)
    return diagnosed(problem.model, problem.parameter_set, design, found)


def diagnosed(
    model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure
) -> tuple[Diagnosis, ...]:  # fmt: skip
    """The same for any design of a model whose roots have a structure."""
    if all(root.multiplicity == 1 for root in structure.roots):
        return ()
    with flint.ctx.workprec(_BITS):
        ideal = _ideal(model, of, design, structure)
        return tuple(
            _diagnosis(model, of, design, structure, ideal, place)
            for place, (root, _) in enumerate(ideal)
            if root.multiplicity > 1 and root.im >= 0
        )


_Ideal = Sequence[tuple[Root, Any]]
"""Each root of the nearest polynomial with the structure, and as a complex ball without a radius."""


def _ideal(model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure) -> _Ideal:
    coefficients = model.coefficients({n: exact(x) for n, x in design.items()}, of)
    balls = nearest(structure.name, coefficients, structure.roots)
    if balls is None:
        return [(r, flint.acb(r.re, r.im)) for r in structure.roots]
    middles = [flint.acb(z.re.mid(), z.im.mid()) for z in balls]
    return [
        (Root(float(m.real), float(m.imag), z.multiplicity), m) for z, m in zip(balls, middles, strict=True)
    ]  # fmt: skip


def _diagnosis(
    model: Model, of: ParameterSet, design: Mapping[str, float], structure: Structure, ideal: _Ideal, place: int
) -> Diagnosis:
    root, s = ideal[place]
    k = root.multiplicity
    ranks = _ranks(model, of, design, structure.distance, s, k)
    partial = ranks.partial if ranks else (k,)
    geometric = ranks.geometric if ranks else 1
    kind = "semisimple" if geometric == k else "defective" if geometric == 1 else "partly defective"
    responses = [_response(model, of, design, ideal, place, name) for name in of.names]
    return Diagnosis(
        re=root.re,
        im=root.im,
        algebraic=k,
        geometric=geometric,
        partial=partial,
        kind=kind,
        jordan=ranks,
        distance=structure.distance,
        responses=tuple(sorted(responses, key=_sensitivity)),
    )


def _ranks(
    model: Model, of: ParameterSet, design: Mapping[str, float], distance: float, s: Any, k: int
) -> Jordan | None:  # fmt: skip
    """Jordan structure by the matrices; None without them, or if they are singular for every s."""
    if model.pencil is None:
        return None
    matrices = model.pencil(of.native({n: flint.arb(x) for n, x in design.items()}))
    threshold = max(_RANK, _TIMES * math.sqrt(distance))
    return jordan(matrices, s, k, threshold) if is_regular(matrices, s, threshold) else None


def _sensitivity(response: Response) -> tuple[float, float]:
    if not response.laws:
        return math.inf, 0.0
    first = response.laws[0].branches
    return float(first.exponent), -first.size


def _response(
    model: Model, of: ParameterSet, design: Mapping[str, float], ideal: _Ideal, place: int, name: str
) -> Response:
    root, s = ideal[place]
    k = root.multiplicity
    relative = design[name] != 0
    step = exact(design[name]) if relative else exact(1.0)

    def changed(by: Any) -> list[Any]:
        varied: dict[str, Any] = {n: flint.arb(x) for n, x in design.items()}
        varied[name] = varied[name] + flint.arb(step) * by
        return model.coefficients(varied, of)

    own = [_ball(c) for c in changed(flint.arb(0))]
    base = [own[0] * c for c in product(*([1, -z] for r, z in ideal for _ in range(r.multiplicity)))]
    series = changed(flint.arb_series([0, 1], prec=k + 1))
    unit = abs(s) if abs(s) > 0 else abs(max((z for _, z in ideal), key=lambda z: float(abs(z)))) or flint.arb(1)
    size = _taylor([abs(c) for c in base], abs(s), unit, k)
    terms = [[0j] * k + [_number(_taylor(base, s, unit, k)[k])]]
    for m in range(1, k + 1):
        order = [c[m] if isinstance(c, flint.arb_series) else flint.arb(0) for c in series]
        values, sizes = _taylor(order, s, unit, k), _taylor([abs(c) for c in order], abs(s), unit, k)
        floors = [_NOTHING * _middle(a) + _FAINT * _middle(b) for a, b in zip(sizes, size, strict=True)]
        terms.append([z if abs(z := _number(v)) > f else 0j for v, f in zip(values, floors, strict=True)])
    found, unmoved = branches(terms)
    laws = []
    for branch in found:
        below, above = (_holds(branch, k, base, own, changed, (s, unit), sign) for sign in (-1, 1))
        laws.append(Law(_in_unit(branch, float(unit.mid())), below, above))
    return Response(name, relative, tuple(laws), unmoved)


def _holds(
    branch: Branches, k: int, base: Sequence[Any], own: Sequence[Any], changed: Any, about: tuple[Any, Any], sign: int
) -> float:
    """The largest sampled change up to which the roots are where the leading term has them; about = root, unit."""

    def held(eps: float) -> bool:
        change = changed(flint.arb(sign) * eps)
        coefficients = [b + _ball(c) - o for b, c, o in zip(base, change, own, strict=True)]
        return _deviation(branch.shifts(sign * eps), k, coefficients, *about) <= DEVIATION

    first = next((m for m in _DECADES if not held(10.0**m)), None)
    if first is None:
        return 10.0 ** _DECADES[-1]
    if first == _DECADES[0]:
        return 0.0
    return 10.0 ** next((first - 1 + share for share in _WITHIN if held(10.0 ** (first - 1 + share))), first - 1)


def _deviation(predicted: Sequence[complex], k: int, coefficients: Sequence[Any], s: Any, unit: Any) -> float:
    """The largest distance of a predicted shift from the nearest true one, relative; inf where there is none."""
    scale = max(abs(t) for t in predicted)
    shifted = _taylor(coefficients, s, unit * scale, len(coefficients) - 1)
    # Of 1/t, so that those sought are the largest roots: companion eigenvalues have these to all digits.
    values = np.array([_number(c / shifted[k].abs_upper()) for c in shifted])
    if not np.all(np.isfinite(values)) or not np.any(values[: k + 1]):
        return math.inf
    inverse = np.roots(values)
    actual = scale / inverse[inverse != 0]
    return max(float(np.abs(actual - t).min(initial=np.inf)) / abs(t) for t in predicted)


def _in_unit(branch: Branches, unit: float) -> Branches:
    """With the shift in the unit of s."""
    constants = tuple(c * unit**branch.denominator for c in branch.constants)
    return Branches(branch.roots, branch.numerator, branch.denominator, constants)


def _taylor(coefficients: Sequence[Any], s: Any, unit: Any, last: int) -> list[Any]:
    """Coefficients in t of p(s + unit t), ascending, up to a power."""
    n = len(coefficients) - 1
    found = []
    for j in range(last + 1):
        terms = (comb(n - i, j) * c * s ** (n - i - j) for i, c in enumerate(coefficients[: n - j + 1]))
        found.append(flint.acb(sum(terms, flint.acb(0)) * unit**j))
    return found


def _ball(x: Any) -> Any:
    return x[0] if isinstance(x, flint.arb_series) else flint.arb(x)


def _number(x: Any) -> complex:
    return complex(float(x.real.mid()), float(x.imag.mid()))


def _middle(x: Any) -> float:
    return float(abs(x).mid())


def _law(law: Law) -> dict[str, Any]:
    b = law.branches
    return {
        "roots": b.roots,
        "exponent": str(b.exponent),
        "numerator": b.numerator,
        "denominator": b.denominator,
        "constants": [{"re": _short(c.real), "im": _short(c.imag)} for c in b.constants],
        "size": _short(b.size),
        "holds": {"below": _short(law.below), "above": _short(law.above), "deviation": DEVIATION},
    }


def _singular(ranks: Jordan) -> dict[str, float | None]:
    return {
        "zero": _short(ranks.zero),
        "nonzero": _short(ranks.nonzero) if math.isfinite(ranks.nonzero) else None,
        "threshold": _short(ranks.threshold),
    }


def _short(x: float) -> float:
    return float(f"{x:.6g}")
