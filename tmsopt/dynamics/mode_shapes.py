"""Shapes of modes: how lean and steer go together at each root, one shape for all the roots that meet in a chain."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.analysis import diagnose_roots
from tmsopt.dynamics.system import ANGLES, coordinates_of, matrices_of
from tmsopt.models.user_spectrum import eigenfrequencies, user_roots
from tmsopt.problem.problem import Posed
from tmsopt.records import Complex, Table, plain
from tmsopt.roots import Root, Structure

_DIGITS = 9  # of a shape: singular vectors have a few less than doubles have
_NOTHING = 1e-12  # of the largest amplitude: one so small has no phase


@dataclass(frozen=True)
class ModeShape:
    """One shape of a root, of a pair of the upper one: e^(st) times these amplitudes solves the equations of motion.

    Attributes:
        re, im: the root, per unit of time of the motion; of a complex H s = −i ω.
        multiplicity: how many roots meet there.
        geometric: how many independent shapes they have left; 1 where all have merged in this one.
        partial: lengths of their Jordan chains, longest first: a chain of k moves as t^(k−1) e^(st).
        amplitudes: of each coordinate, the largest 1.
        phases: in degrees, by which each is ahead of the first (of lean), from −180 to 180; nan of one at rest. Of a
            complex H the argument of ψₖ/ψ₁, of motion as e^(−iωt).
        eigenfrequency: of a complex H ω = i s, else None.
    """

    re: float
    im: float
    multiplicity: int
    geometric: int
    partial: tuple[int, ...]
    amplitudes: Table[float]
    phases: Table[float]
    eigenfrequency: complex | None = None

    @property
    def steer_per_lean(self) -> float:
        """Amplitude of steer for each of lean; nan without these, inf where it does not lean."""
        lean, steer = (self.amplitudes.get(n, math.nan) for n in ANGLES)
        return math.inf if lean == 0 and steer else steer / lean

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        ratio = plain(self, "steer_per_lean", digits=_DIGITS) if "delta" in self.amplitudes else {}
        shape = plain(self, "amplitudes phases", digits=_DIGITS)
        omega = plain(self, "eigenfrequency") if self.eigenfrequency is not None else {}
        return plain(self, "re im") | omega | plain(self, "multiplicity geometric partial") | shape | ratio


def mode_shapes(
    problem: Posed, parameters: Mapping[str, float], structure: Structure, rate: float
) -> tuple[ModeShape, ...]:
    """The shapes at every root of a design, rightmost first: null vectors of its matrices at the root.

    They are the right singular vectors of L(s) with the smallest singular values, at the roots of the ideal design:
    where roots meet, those of the design as rounded are scattered around it. Of a complex H L(s) = s + i H.

    Args:
        rate: how many 1/s a rate of 1 is.
    """
    model, of = problem.model, problem.parameter_set
    pencil = matrices_of(model)(of.native(parameters))
    names = coordinates_of(model, pencil)
    chains = diagnose_roots(model, of, parameters, structure)
    if model.double is not None:  # −[[J, R], [−R, J]]
        n = len(names)
        pencil = [np.eye(n), pencil[1][:n, :n] - 1j * pencil[1][:n, n:]]
    roots = [r for r in user_roots(model, structure.roots) if model.double or r.im >= 0]
    found = []
    partial: tuple[int, ...]
    for root in sorted(roots, key=lambda r: (-r.re, -r.im)):
        s, geometric, partial = complex(root.re, root.im), 1, (1,)
        chain = min(chains, key=lambda d: abs(complex(d.re, d.im) - s), default=None)
        if root.multiplicity > 1 and chain is not None:
            s, geometric, partial = complex(chain.re, chain.im), chain.geometric, chain.partial
        vectors = _null(pencil, s, geometric)
        omega = next((complex(z.re, z.im) for z in eigenfrequencies(model, [Root(s.real, s.imag)])), None)
        for vector in vectors:
            columns = _amplitudes(vector[: len(names)])
            sizes, turns = (Table(dict(zip(names, column, strict=True))) for column in columns)
            at = rate * s.real, rate * s.imag
            found.append(ModeShape(*at, root.multiplicity, len(vectors), partial, sizes, turns, omega))
    return tuple(found)


def _null(pencil: Sequence[Any], s: complex, count: int) -> Complex:
    """The vectors that L(s) = Σ Pₖ s^(d−k) takes to 0, as rows; it is scaled first, so that units play no part."""
    powers = [s ** (len(pencil) - 1 - k) for k in range(len(pencil))]
    L = sum(z * P for z, P in zip(powers, pencil, strict=True))
    size = sum(abs(z) * np.abs(P) for z, P in zip(powers, pencil, strict=True))
    rows = 1 / _or_one(size.max(axis=1, keepdims=True))
    columns = 1 / _or_one((rows * size).max(axis=0))
    vectors: Complex = np.linalg.svd(rows * L * columns)[2][-count:].conj() * columns
    return vectors


def _or_one(sizes: Any) -> Any:
    return np.where(sizes > 0, sizes, 1.0)


def _amplitudes(vector: Complex) -> tuple[list[float], list[float]]:
    """Amplitudes and phases; the first coordinate that moves has phase 0."""
    sizes = np.abs(vector) / np.abs(vector).max()
    moving = sizes > _NOTHING
    turned = vector / vector[int(np.argmax(moving))]
    clean = np.where(np.abs(turned.imag) > _NOTHING * np.abs(turned), turned, turned.real)
    return np.where(moving, sizes, 0.0).tolist(), np.where(moving, np.degrees(np.angle(clean)), np.nan).tolist()
