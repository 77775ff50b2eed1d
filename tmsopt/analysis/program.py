"""The smooth program around a design: its roots on the rightmost line as factors, and all that is held at a limit.

About the line Re s = γ the polynomial splits into factors without common roots,

    p(t + γ; θ) = a0(θ) · q₁(t) ⋯ q_k(t) · r(t),

one factor q of degree m for each m-fold root on the line, and r for the roots left of it. Its coefficients are smooth
functions of θ and γ, also where the roots are not, for the Jacobian of a product in its factors is regular as long
as they have no common root. With tᵐ + c₁ tᵐ⁻¹ + … + c_m for a real root, and the same in t − iω with complex c (c₁
real, which fixes ω) for a complex one, a root stands on the line where c = 0, and no root passes it only if

    c₁ ≥ 0 (roots move left),  Re c₂ ≥ 0 (roots move apart along the line),  Im c₂ = c₃ = … = 0 to first order,

because |Im c₂| ≤ c₁ √Re c₂ and c₃ ≤ c₁ c₂: of the other coefficients a change ε would send a root ε^(1/m) to the
right. For EP4 as two factors t² + βᵢ t + κᵢ these are c₁ = β₁ + β₂ and c₂ = κ₁ + κ₂ + β₁β₂, so βᵢ and κᵢ have the
multipliers of c₁ and c₂, whichever way a multiple root is shared out between factors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import abscissa, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.records import Array
from tmsopt.roots import Root, product, shift

_ACTIVE = 2e-9  # slack, relative to 1 + |limit|, up to which a constraint is held: twice what a feasible point may have
_AT = 1e-12  # likewise of a bound, relative to its size and the width of its range
_LINE = 1e-6  # relative difference of real parts on one vertical line, for roots of an exact structure
_ROOT_ROWS = ("abscissa", "damping_ratio", ANGULAR_FREQUENCY)  # rows of factors, which this program has of its own


class NotCovered(ValueError):
    """A question that the conditions on the factors do not answer, with the reason."""


@dataclass(frozen=True)
class Held:
    """Something that is 0 at the design.

    Attributes:
        name: of a constraint or bound, ``roots`` for an equation of the factors, ``c1 …`` for a coefficient.
        signed: whether it may become positive; otherwise it stays 0.
        cluster: number of the root on the line whose factor it belongs to; −1 for other things.
        size: its natural size, for comparison with others.
    """

    name: str
    signed: bool
    cluster: int = -1
    size: float = 1.0


@dataclass(frozen=True)
class LocalProgram:
    """minimise f(x) with h(x) = 0 or ≥ 0, at a point where all of h is 0.

    Attributes:
        problem: whose objective is f.
        variables: names; the free parameters that matter first, each as itself or as its tangent.
        x: the point.
        sizes: natural size of each variable.
        held: what the rows of h are.
        functions: (x, y) → f, ∇f, h, ∂h/∂x and the Hessian of f − y·h.
        line: the roots on the rightmost line, complex pairs by their upper root.
        idle: free parameters without any part in the program.
    """

    problem: Posed
    variables: tuple[str, ...]
    x: Array
    sizes: Array
    held: tuple[Held, ...]
    functions: ca.Function = field(repr=False)
    line: tuple[Root, ...]
    idle: tuple[str, ...]

    def at(self, x: Array, y: Array | None = None) -> tuple[float, Array, Array, Array, Array]:
        """f, ∇f, h, ∂h/∂x, and the Hessian of f − y·h."""
        f, gradient, h, jacobian, hessian = (
            np.array(part) for part in self.functions(x, np.zeros(len(self.held)) if y is None else y)
        )
        return float(f.item()), gradient.ravel(), h.ravel(), jacobian, hessian


def program(problem: Posed, solution: Solution) -> LocalProgram:
    """The program of a problem at a design, from the roots of its structure; none is computed again.

    Raises:
        NotCovered: where the damping ratio binds, or the abscissa does not.
    """
    nlp = abscissa(problem)
    symbols = ca.SX.sym("x", len(nlp.variables))
    f, g = nlp.symbolic(symbols)
    values = problem.values(solution.parameters)
    point = dict(zip(problem.free, variables_of(problem, solution.parameters), strict=True))
    names = [*problem.free, *nlp.variables[len(problem.free) :]]
    known = {
        n: point[n]
        if n in point
        else solution.abscissa / nlp.unit
        if n == "abscissa"
        else _value(values, n) / (nlp.unit if n == ANGULAR_FREQUENCY else 1)
        for n in names
    }
    at = ca.Function("rows", [symbols], [g])
    reached = np.array(at([known[n] if np.isfinite(known[n]) else 0.0 for n in names])).ravel()
    steady = [i for i, name in enumerate(names) if _steady(nlp, name, reached)]
    f, g = ca.substitute([f, g], [symbols[i] for i in steady], [ca.SX(known[names[i]]) for i in steady])
    build = _Rows()
    for k, name in enumerate(nlp.rows):
        if name in problem.constraints and ca.depends_on(g[k], symbols):
            build.row(name, g[k], reached[k], nlp.row_lower[k], nlp.row_upper[k])
    needed = ["abscissa"] if "abscissa" in names else []
    for _ in nlp.lifts:
        binding = ca.vertcat(f, *build.rows)
        for i in range(len(problem.free), len(names)):
            if names[i] not in needed and ca.depends_on(binding, symbols[i]):
                needed.append(names[i])
                for k in _rows_of(nlp, names[i]):
                    build.row(names[i], g[k], reached[k], nlp.row_lower[k], nlp.row_upper[k])
    if "damping_ratio" in needed:
        raise NotCovered("the damping ratio binds, which the conditions on the abscissa do not cover")
    if ANGULAR_FREQUENCY in needed:
        raise NotCovered("the angular frequency binds, which the conditions on the abscissa do not cover")
    if "abscissa" not in needed or not ca.depends_on(ca.vertcat(f, *build.rows), symbols[names.index("abscissa")]):
        raise NotCovered("the abscissa does not bind, so the roots have no part in this optimum")
    line, rest = on_the_line(solution)
    design = {
        n: ca.atan(s) if problem.parameter_set[n].tangent else s
        for n, s in zip(problem.free, ca.vertsplit(symbols), strict=False)
    }
    gamma = nlp.unit * symbols[names.index("abscissa")]
    a = problem.model.coefficients(problem.ordered(design), problem.parameter_set)
    factored = _factored(build, a, float(values.coefficients[0]), gamma, line, rest)
    expression = ca.vertcat(f, *build.rows)
    idle = tuple(n for k, n in enumerate(problem.free) if not ca.depends_on(expression, symbols[k]))
    kept = [k for k, n in enumerate(names) if (n in problem.free and n not in idle) or n in needed]
    for k in (k for k in kept if names[k] in problem.free):
        for end, limit in zip(("min", "max"), problem.free[names[k]], strict=True):
            width = np.ptp(problem.free[names[k]])
            if abs(solution.parameters[names[k]] - limit) <= _AT * (abs(limit) + width):
                bound = symbols[k] - known[names[k]]
                build.one(Held(f"{names[k]}.{end}", True), bound if end == "min" else -bound)
    size = max(np.hypot(r.re, r.im) for r in solution.of_polynomial.roots)
    widths = [
        _natural_size(problem, names[k], known[names[k]])
        if names[k] in problem.free
        else size / nlp.unit
        if names[k] == "abscissa"
        else max(abs(known[names[k]]), 1e-3)
        for k in kept
    ]
    x = ca.vertcat(*(symbols[k] for k in kept), *factored.unknowns)
    return LocalProgram(
        problem=problem,
        variables=(*(names[k] for k in kept), *factored.names),
        x=np.array([*(known[names[k]] for k in kept), *factored.values]),
        sizes=np.array([*widths, *factored.sizes]),
        held=tuple(build.held),
        functions=_derivatives(x, f, ca.vertcat(*build.rows)),
        line=line,
        idle=idle,
    )


def on_the_line(solution: Solution) -> tuple[tuple[Root, ...], tuple[Root, ...]]:
    """The roots on the rightmost line, complex pairs by their upper root, and all others."""
    size = max(np.hypot(r.re, r.im) for r in solution.of_polynomial.roots)
    near = 0.0 if solution.of_polynomial.name in ("pair", "real") else _LINE * size
    line = [r for r in solution.of_polynomial.roots if r.re >= solution.abscissa - near]
    return tuple(r for r in line if r.im >= 0), tuple(r for r in solution.of_polynomial.roots if r not in line)


def _rows_of(nlp: NLP, name: str) -> list[int]:
    """Rows that tie a lifted quantity to the parameters; a constant piece of it, which has a leeway, does not."""
    tied = enumerate(zip(nlp.rows, nlp.row_lower, strict=True))
    return [k for k, (row, lower) in tied if row == name and row not in _ROOT_ROWS and lower == 0]


def _steady(nlp: NLP, name: str, reached: Array) -> bool:
    """Whether a quantity that is the greatest of several is the constant one of them here."""
    return (
        name in nlp.rows
        and all(nlp.row_upper[k] > 0 and reached[k] > _ACTIVE for k in _rows_of(nlp, name))
        and name not in _ROOT_ROWS
    )


class _Rows:
    """Collects what is held; discarded once the program is finished."""

    def __init__(self) -> None:
        self.held: list[Held] = []
        self.rows: list[Any] = []

    def one(self, held: Held, expression: Any) -> None:
        self.held.append(held)
        self.rows.append(expression)

    def row(self, name: str, expression: Any, value: float, lower: float, upper: float) -> None:
        """A row of the NLP, if it is an equality or holds with equality."""
        if lower == upper:
            self.one(Held(name, False), expression - lower)
        elif np.isfinite(lower) and abs(value - lower) <= _ACTIVE * (1 + abs(lower)):
            self.one(Held(name, True), expression - lower)
        elif np.isfinite(upper) and abs(value - upper) <= _ACTIVE * (1 + abs(upper)):
            self.one(Held(name, True), upper - expression)


@dataclass(frozen=True)
class _Factored:
    """The coefficients of the factors as unknowns."""

    names: list[str]
    unknowns: list[Any]
    values: list[float]
    sizes: list[float]


def _factored(
    build: _Rows, a: Sequence[Any], lead: float, gamma: Any, line: Sequence[Root], rest: Sequence[Root]
) -> _Factored:
    """p(t + γ) = a0 · ∏ q · r with the roots of the structure as the values of the unknowns; `lead` is a0's."""
    made = _Factored([], [], [], [])
    size = max(np.hypot(r.re, r.im) for r in (*line, *rest))

    def unknown(name: str, value: float, power: int) -> Any:
        symbol = ca.SX.sym(name)
        made.names.append(name)
        made.unknowns.append(symbol)
        made.values.append(value)
        made.sizes.append(size**power)
        return symbol

    def coefficient(name: str, power: int, cluster: int, signed: bool) -> Any:
        symbol = unknown(f"{name}.{cluster}", 0.0, power)
        build.one(Held(name, signed, cluster, size**power), symbol)
        return symbol

    factors = []
    for j, root in enumerate(line):
        if not root.im:
            factors.append([1, *(coefficient(f"c{k}", k, j, k <= 2) for k in range(1, root.multiplicity + 1))])
            continue
        omega = unknown(f"omega.{j}", root.im, 1)
        real, imaginary = [1, coefficient("c1", 1, j, True)], [0, 0]
        for k in range(2, root.multiplicity + 1):
            real.append(coefficient(f"c{k}", k, j, k == 2))
            imaginary.append(coefficient(f"im c{k}", k, j, False))
        factors.append(_squared(*_about(omega, real, imaginary)))
    others = [z for r in rest for z in [complex(r.re, r.im) - line[0].re] * r.multiplicity]
    monic = np.atleast_1d(np.poly(others)).real
    factors.append([1, *(unknown(f"r{k}", float(monic[k]), k) for k in range(1, len(monic)))])
    moved, matched = shift(a, gamma), product(*factors)
    for k in range(1, len(moved)):
        build.one(Held("roots", False, size=abs(lead) * size**k), moved[k] - a[0] * matched[k])
    return made


def _about(omega: Any, real: Sequence[Any], imaginary: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Coefficients in t of a complex polynomial in t − iω: a Taylor shift by Horner division."""
    re, im = list(real), list(imaginary)
    for end in range(len(re), 1, -1):
        for k in range(1, end):
            re[k], im[k] = re[k] + omega * im[k - 1], im[k] - omega * re[k - 1]
    return re, im


def _squared(re: Sequence[Any], im: Sequence[Any]) -> list[Any]:
    """A complex polynomial times its conjugate."""
    return [a + b for a, b in zip(product(re, re), product(im, im), strict=True)]


def _derivatives(x: Any, f: Any, h: Any) -> ca.Function:
    y = ca.SX.sym("y", h.numel())
    lagrangian = f - ca.dot(y, h)
    parts = [f, ca.gradient(f, x), h, ca.jacobian(h, x), ca.hessian(lagrangian, x)[0]]
    return ca.Function("held", [x, y], [ca.densify(part) for part in parts])


def _value(values: Mapping[str, Any], name: str) -> float:
    """A lifted quantity of the design; nan for a coefficient of a factor, which this program does not use."""
    return float(values[name]) if name in set(values) else np.nan


def _natural_size(problem: Posed, name: str, value: float) -> float:
    """Size of a parameter: its own, or the width of its range as the program sees it, which beyond 1 says nothing."""
    ends = problem.free[name]
    low, high = (float(np.tan(e)) if problem.parameter_set[name].tangent else e for e in ends)
    return max(abs(value), min(high - low, 1.0), 1e-12)
