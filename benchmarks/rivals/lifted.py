"""Local steps that are smooth at multiple roots: SLSQP in the parameters and in the factors of the polynomial."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from benchmarks.judges import Designs, Roots, eigenvalues, evaluated
from tmsopt.records import Array

_STEP = 1e-7  # of the box, for differences
_STEPS, _EVALUATIONS = 60, 120  # of SLSQP, which may go on for ever beside a kink
_SMALL = 1e-12  # imaginary part of a real root, relative


@dataclass(frozen=True)
class Lifted:
    """A problem in variables (u, A, D, factors): parameters from 0 to 1, a bound above every real part and one below
    every damping ratio, and (b, c) of each factor s² + b s + c, with r of s + r where the degree is odd.

    All roots of a factor are left of A if 2 A + b >= 0 and A² + b A + c >= 0, and damped by D if b >= 2 D √c, c >= 0.
    """

    at: Designs
    margin: float = 0.0

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.at.lower)

    def x(self, u: Array) -> Array:
        """Parameters of shape (free, designs)."""
        lower, upper = self.at.lower[:, None], self.at.upper[:, None]
        return np.asarray(np.clip(lower + (upper - lower) * u, lower, upper))

    def solved(self, start: Array, pairing: int, tries: int = 2) -> Array:
        """Where SLSQP ends, begun anew from its end."""
        u = start
        for _ in range(tries):
            before, u = u, self._once(u, pairing)
            if np.abs(u - before).max() < 1e-9:
                break
        return u

    def _once(self, start: Array, pairing: int) -> Array:
        at, n = self.at, self.size
        a = self._monic(start[:, None])[0]
        if not np.all(np.isfinite(a)):
            return start
        z = eigenvalues(a[None])[0]
        factors = _factors(z, pairing)
        ratio = -z.real / np.where(np.abs(z) > 0, np.abs(z), 1.0)
        first: Any = np.concatenate([start, [z.real.max(), ratio.min()], factors])
        damped = any("damping_ratio" in text for text in (self._objective, *(r.text for r in at.rows)))
        right = any("abscissa" in text for text in (self._objective, *(r.text for r in at.rows)))
        scale = np.maximum(np.abs(a[1:]), 1e-3 * np.abs(a).max())
        known: dict[bytes, Any] = {}

        last = first

        def every(w: Array) -> Any:
            nonlocal last
            key = w.tobytes()
            if key not in known:
                if len(known) >= _EVALUATIONS:
                    raise StopIteration
                known[key], last = self._evaluated(w, right, damped, scale), w.copy()
            return known[key]

        rules: Any = [
            {"type": "ineq", "fun": lambda w: every(w)[1], "jac": lambda w: every(w)[4]},
            {"type": "eq", "fun": lambda w: every(w)[2], "jac": lambda w: every(w)[5]},
        ]

        def value(w: Array) -> float:
            return float(every(w)[0])

        way: dict[str, Any] = {"method": "SLSQP", "options": {"maxiter": _STEPS, "ftol": 1e-15}}
        way |= {
            "jac": lambda w: every(w)[3],
            "bounds": [(0, 1)] * n + [(None, None)] * (len(first) - n),
            "constraints": rules,
        }
        with contextlib.suppress(StopIteration):
            last = np.asarray(minimize(value, first, **way).x)
        return np.asarray(np.clip(np.nan_to_num(last[:n], nan=0.5), 0, 1))

    @property
    def _objective(self) -> str:
        assert self.at.problem.posed.objective is not None
        return self.at.problem.posed.objective.text

    def _monic(self, u: Array) -> Array:
        with np.errstate(all="ignore"):
            a = self.at.coefficients(self.at.values(self.x(u)), u.shape[1])
            return np.asarray(a / a[:, :1])

    def _evaluated(self, w: Array, right: bool, damped: bool, scale: Array) -> Any:
        """Value, inequalities (>= 0), equations, and the slopes of all three."""
        at, n, count = self.at, self.size, len(w)
        shift = np.where(w > 0.5, -_STEP, _STEP)
        around = np.concatenate([w[:, None], w[:, None] + np.diag(shift)], axis=1)
        size = np.zeros(count + 1)
        with np.errstate(all="ignore"):
            values = at.values(self.x(around[:n]))
            a = at.coefficients(values, count + 1)
            a = a / a[:, :1]
            values = values.with_known({"abscissa": around[n], "damping_ratio": around[n + 1]})
            value = at.sign * (np.asarray(evaluated(at.objective, values)) + size)
            below = [-self.margin - r.apart(values) + size for r in at.rows if r.comparison != "=="]
            equal = [np.asarray(r.apart(values)) + size for r in at.rows if r.comparison == "=="]
            product = np.ones((1, count + 1))
            A, D = around[n], around[n + 1]
            rest = around[n + 2 :]
            for k in range(0, len(rest) - 1, 2):
                b, c = rest[k], rest[k + 1]
                product = _times(product, np.array([size + 1, b, c]))
                below += [2 * A + b, A * A + b * A + c] if right else []
                below += [c, b - 2 * D * np.sqrt(np.maximum(c, 0))] if damped else []
            if len(rest) % 2:
                product = _times(product, np.array([size + 1, rest[-1]]))
                below += [A + rest[-1]] if right else []
                below += [rest[-1]] if damped else []
            equal += list((product[1:] - a.T[1:]) / scale[:, None])
        g, h = np.array(below).reshape(-1, count + 1), np.array(equal)
        found = [np.nan_to_num(part, nan=-1.0, posinf=1e6, neginf=-1e6) for part in (value[None], g, h)]
        slopes = [(part[:, 1:] - part[:, :1]) / shift for part in found]
        return float(found[0][0, 0]), found[1][:, 0], found[2][:, 0], slopes[0][0], slopes[1], slopes[2]


def _times(one: Array, other: Array) -> Array:
    """Products of polynomials, descending, one in each column."""
    found = np.zeros((len(one) + len(other) - 1, one.shape[1]))
    for k, row in enumerate(other):
        found[k : k + len(one)] += one * row
    return found


def _factors(z: Roots, pairing: int) -> Array:
    """(b, c) of pairs of roots, and r of the one left over; real roots pair as neighbours, or the ends together."""
    real = np.sort(z[np.abs(z.imag) <= _SMALL * np.abs(z)].real)
    above = z[z.imag > _SMALL * np.abs(z)]
    pairs = [(-2 * w.real, abs(w) ** 2) for w in above]
    alone = []
    if len(real) % 2:
        alone, real = [-real[-1 if pairing % 2 else 0]], real[:-1] if pairing % 2 else real[1:]
    half = len(real) // 2
    mates = zip(real[:half], real[::-1], strict=False) if pairing >= 2 else zip(real[::2], real[1::2], strict=True)
    pairs += [(-(p + q), p * q) for p, q in mates]
    return np.array([v for pair in pairs for v in pair] + alone, dtype=float)


def lifted(at: Designs, start: Array, margin: float = 0.0) -> Iterator[Array]:
    """Ends of SLSQP from one start, for the ways to pair its real roots."""
    way = Lifted(at, margin)
    with np.errstate(all="ignore"):
        a = at.coefficients(at.values(way.x(start[:, None])), 1)
    paired = {_factors(eigenvalues(a)[0], pairing).tobytes(): pairing for pairing in (3, 0)}
    for pairing in paired.values():
        try:
            yield way.solved(start, pairing)
        except (ValueError, np.linalg.LinAlgError, IndexError):
            continue
