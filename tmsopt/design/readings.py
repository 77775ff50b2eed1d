"""A design in the units that its builder reads: seconds, hertz, millimetres, km/h, degrees."""

import math
from collections.abc import Iterable, Mapping

from tmsopt.design.units import reading
from tmsopt.models import ParameterSet
from tmsopt.roots import Root

Reading = float | tuple[float, ...]
"""A number, or one for each of several roots; nan where it does not exist."""


def decay_time(abscissa: float, rate: float) -> float:
    """Seconds in which the slowest part of a disturbance falls to 1/e; nan unless it falls.

    Args:
        abscissa: largest real part of the roots, dimensionless.
        rate: how many 1/s a rate of 1 is (`ParameterSet.rate`).
    """
    return 1 / (-abscissa * rate) if abscissa < 0 else math.nan


def growth_time(abscissa: float, rate: float) -> float:
    """Seconds in which the fastest part of a disturbance grows e-fold; nan unless it grows."""
    return decay_time(-abscissa, rate)


def frequencies(roots: Iterable[Root], rate: float) -> tuple[float, ...]:
    """Frequency in Hz of each distinct oscillating pair of roots, in the order of the roots."""
    return tuple(root.im * rate / (2 * math.pi) for root in roots if root.im > 0)


def readings(
    of: ParameterSet,
    parameters: Mapping[str, float],
    quantities: Mapping[str, float],
    abscissa: float,
    roots: Iterable[Root],
) -> dict[str, Reading]:
    """Times, frequencies, and everything with a unit, by names that end in the unit: ``v_kmh``, ``x_B_mm``.

    Empty for a set that has no unit of time.
    """
    if of.rate is None:
        return {}
    rate = float(of.rate(parameters))
    found: dict[str, Reading] = {
        "decay_time_s": decay_time(abscissa, rate),
        "growth_time_s": growth_time(abscissa, rate),
        "frequencies_Hz": frequencies(roots, rate),
    }
    units = {p.name: p.unit for p in of.parameters} | {q.name: q.unit for q in of.quantities}
    known = {**parameters, **quantities}
    for name in (n for n, unit in units.items() if unit != "1"):
        value, unit = reading(known[name], units[name])
        found[f"{name}_{''.join(filter(str.isalnum, unit))}"] = value
    return found
