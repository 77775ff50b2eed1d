"""Mode shapes: amplitude and phase of lean and steer at each root, one shape for each Jordan chain."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.analysis import diagnose_roots
from tmsopt.dynamics.system import ANGLES, coordinates_of, matrices_of
from tmsopt.models.user_spectrum import eigenfrequencies
from tmsopt.problem.problem import Posed
from tmsopt.records import Complex, Table, plain
from tmsopt.roots import Root, Structure

_DIGITS = 9  # printed digits of a shape; singular vectors have fewer correct digits than doubles
_ZERO_AMPLITUDE = 1e-12  # amplitude, relative to the largest, below which a coordinate has no phase


@dataclass(frozen=True)
class ModeShape:
    """One shape of a root, or of the upper root of a pair. The shape times e^(st) solves the equations of motion.

    Attributes:
        re, im: the root, per unit of time of the motion; s = −i ω for a complex H.
        multiplicity: number of roots that coincide in this root.
        geometric: number of independent shapes; 1 if all shapes have merged.
        partial: lengths of the Jordan chains, longest first; a chain of length k has motions up to t^(k−1) e^(st).
        amplitudes: amplitude of each coordinate; the largest amplitude is 1.
        phases: by how many degrees a coordinate is ahead of the first coordinate (lean), from −180 to 180; nan for a
            coordinate at rest.
            For a complex H, it is the argument of ψₖ/ψ₁, for a motion proportional to e^(−iωt).
        eigenfrequency: ω = i s for a complex H, otherwise None.
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
        """Ratio of the steer amplitude to the lean amplitude; nan without these coordinates, inf without lean."""
        lean, steer = (self.amplitudes.get(n, math.nan) for n in ANGLES)
        return math.inf if lean == 0 and steer else steer / lean

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        ratio = plain(self, "steer_per_lean", digits=_DIGITS) if "delta" in self.amplitudes else {}
        shape = plain(self, "amplitudes phases", digits=_DIGITS)
        omega = plain(self, "eigenfrequency") if self.eigenfrequency is not None else {}
        return plain(self, "re im") | omega | plain(self, "multiplicity geometric partial") | shape | ratio


def compute_mode_shapes(
    problem: Posed, parameters: Mapping[str, float], structure: Structure, rate_unit: float
) -> tuple[ModeShape, ...]:
    """Mode shapes at every root of a design, rightmost first: null vectors of its matrices at the root.

    The null vectors are the right singular vectors of L(s) with the smallest singular values. For a complex H, L(s) is
    s + i H. The roots s are the roots before rounding, because rounding to double precision separates multiple roots.

    Args:
        rate_unit: the unit of rates in 1/s.
    """
    model, parameter_set = problem.model, problem.parameter_set
    pencil = matrices_of(model)(parameter_set.native(parameters))
    names = coordinates_of(model, pencil)
    diagnoses = diagnose_roots(model, parameter_set, parameters, structure)
    roots = [r for r in structure.roots if model.is_complex or r.im >= 0]
    shapes = []
    partial: tuple[int, ...]
    for root in sorted(roots, key=lambda r: (-r.re, -r.im)):
        s, geometric, partial = complex(root.re, root.im), 1, (1,)
        diagnosis = min(diagnoses, key=lambda d: abs(complex(d.re, d.im) - s), default=None)
        if root.multiplicity > 1 and diagnosis is not None:
            s, geometric, partial = complex(diagnosis.re, diagnosis.im), diagnosis.geometric, diagnosis.partial
        vectors = _compute_null_vectors(pencil, s, geometric)
        omega = next((complex(z.re, z.im) for z in eigenfrequencies(model, [Root(s.real, s.imag)])), None)
        for vector in vectors:
            columns = _normalise_shape(vector[: len(names)])
            amplitudes, phases = (Table(dict(zip(names, column, strict=True))) for column in columns)
            re, im = rate_unit * s.real, rate_unit * s.imag
            shapes.append(ModeShape(re, im, root.multiplicity, len(vectors), partial, amplitudes, phases, omega))
    return tuple(shapes)


def _compute_null_vectors(pencil: Sequence[Any], s: complex, count: int) -> Complex:
    """Null vectors of L(s) = Σ Pₖ s^(d−k) as rows. L is scaled first, so that the result does not depend on units."""
    powers = [s ** (len(pencil) - 1 - k) for k in range(len(pencil))]
    L = sum(z * P for z, P in zip(powers, pencil, strict=True))
    size = sum(abs(z) * np.abs(P) for z, P in zip(powers, pencil, strict=True))
    row_scales = 1 / _replace_zeros(size.max(axis=1, keepdims=True))
    column_scales = 1 / _replace_zeros((row_scales * size).max(axis=0))
    vectors: Complex = np.linalg.svd(row_scales * L * column_scales)[2][-count:].conj() * column_scales
    return vectors


def _replace_zeros(sizes: Any) -> Any:
    return np.where(sizes > 0, sizes, 1.0)


def _normalise_shape(vector: Complex) -> tuple[list[float], list[float]]:
    """Amplitudes and phases; the first coordinate that moves has phase 0."""
    sizes = np.abs(vector) / np.abs(vector).max()
    is_moving = sizes > _ZERO_AMPLITUDE
    z = vector / vector[int(np.argmax(is_moving))]
    phases = np.degrees(np.angle(np.where(np.abs(z.imag) > _ZERO_AMPLITUDE * np.abs(z), z, z.real)))
    return np.where(is_moving, sizes, 0.0).tolist(), np.where(is_moving, phases, np.nan).tolist()
