"""The rotational inertia at which a two-mass-skate bicycle loses stability, from the equations of Whipple's bicycle."""

from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.models.bicycles.whipple import whipple
from tmsopt.models.built_in import controlled
from tmsopt.records import Numbers, Table
from tmsopt.roots import hurwitz_minors, lienard_chipart
from tmsopt.roots.exact import isolated_roots

INERTIAS = {"I_Bxx": "m_B", "I_Bzz": "m_B", "I_Hxx": "m_H", "I_Hzz": "m_H"}
"""Moment of inertia about the centre of mass of its body → mass of that body."""

_BITS = 400  # precision of tan λ_s and 1/cos λ_s, the only irrational numbers in this computation


def inertia_margin(parameters: Numbers) -> Table[float | None] | None:
    """For each moment of inertia, the least value in kg m² at which a design is no longer stable if the others are 0.

    Whipple's equations without wheels, trail and inertia are the equations of two masses on skates. Their coefficients
    are polynomials in one moment of inertia. Stability is lost at the least positive root of a0 aₙ Δₙ₋₁ with the
    Hurwitz determinant Δₙ₋₁. There a root of the design is infinite or 0, or a pair is on the imaginary axis. The
    computation is exact for parameters in double precision.

    Args:
        parameters: parameters of the model ``tms`` in SI, with the gains of a controller if it has one.

    Returns:
        Name → value, or None if the design stays stable for every value. If the design itself is not stable, the result
        is None.

    Example:
        >>> own = dict(w=1, v=6.9, g=9.81, lambda_s=0.4, m_B=10, x_B=1.4, z_B=-0.4, m_H=1, x_H=1, z_H=-0.2)
        >>> {name: x and round(x, 6) for name, x in tmsopt.models.inertia_margin(own).items()}
        {'I_Bxx': None, 'I_Bzz': None, 'I_Hxx': 0.010779, 'I_Hzz': 0.015763}

    More: docs/how_to/inertia.md
    """
    model = controlled(whipple, parameters)
    si = model.sets[0]
    with flint.ctx.workprec(_BITS):
        si_values = {p.name: flint.arb(float(parameters.get(p.name, p.default or 0.0))) for p in si.parameters}
        points = {name: rational(x) for name, x in model.algebraic(si.native(si_values)).items()}
        coefficients = model.evaluate_polynomial(points)
        sign = 1 if coefficients[0] > 0 else -1
        if not all(x > 0 for x in [sign * coefficients[0], *lienard_chipart([sign * c for c in coefficients])]):
            return None
        x = flint.fmpq_poly([0, 1])
        return Table({name: _least_root(model.evaluate_polynomial({**points, name: x})) for name in INERTIAS})


def _least_root(coefficients: Sequence[Any]) -> float | None:
    """The least positive root of a0 aₙ Δₙ₋₁, with coefficients that are numbers or polynomials in one unknown."""
    *_, minor, _ = hurwitz_minors(coefficients)
    roots = []
    for boundary in (coefficients[0], coefficients[-1], minor):
        terms = list(flint.fmpq_poly([0]) + boundary)[::-1]
        roots += [z.real for z, _ in isolated_roots(terms) if z.imag == 0 and z.real > 0]
    return min((float(z.mid()) for z in roots), default=None)
