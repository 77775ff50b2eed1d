"""How fast roots and classes of many quartics come, beside stacked eigenvalues."""

from collections.abc import Callable

import numpy as np
from numpy.linalg import eigvals

from benchmarks.judges import companion
from benchmarks.reports.tables import Asked, page, table
from benchmarks.timing import best
from tmsopt.models import tms
from tmsopt.records import Array
from tmsopt.roots import (
    abscissa_and_damping,
    backward_error,
    is_stable,
    quartic_classes,
    quartic_factors,
    quartic_is_stable,
    real_roots,
    roots,
)

Work = Callable[[], object]

_POINTS = 100_000
_REPEATS = 9
_EIGENVALUES = "abscissa: stacked `numpy.linalg.eigvals`"
_BASELINE_CLASS = "stable or not: stacked `numpy.linalg.eigvals`"


def designs(count: int, seed: int = 0) -> Array:
    """Coefficients of two-mass-skate designs over a box much wider than any bicycle, shape (5, count)."""
    rng = np.random.default_rng(seed)
    box = {
        "Fr": rng.uniform(0.01, 6, count),
        "mu": 10 ** rng.uniform(-2, 1.5, count),
        "chi_B": rng.uniform(-1, 3, count),
        "chi_H": rng.uniform(-1, 3, count),
        "zeta_B": -(10 ** rng.uniform(-1.3, 0.3, count)),
        "zeta_H": -(10 ** rng.uniform(-1.3, 0.3, count)),
        "lambda_s": np.arctan(rng.uniform(-3, 3, count)),
    }
    return np.stack(tms.coefficients(box))


def random(count: int, seed: int = 0) -> Array:
    """Normal coefficients, shape (5, count)."""
    return np.random.default_rng(seed).normal(size=(5, count))


def works(a: Array) -> dict[str, Work]:
    """What is timed, each from coefficients in memory to answers in memory."""
    rows = np.ascontiguousarray(a.T)
    return {
        _EIGENVALUES: lambda: eigvals(companion(rows)).real.max(axis=1),
        "abscissa: `roots`": lambda: roots(rows).real.max(axis=1),
        "abscissa and damping ratio: quartics by NumPy": lambda: abscissa_and_damping(*a),
        "quadratic factors: quartics by NumPy": lambda: quartic_factors(*a),
        _BASELINE_CLASS: lambda: eigvals(companion(rows)).real.max(axis=1) < 0,
        "stable or not: `is_stable`": lambda: is_stable(rows),
        "stable or not: quartics by NumPy": lambda: quartic_is_stable(*a),
        "class and real roots: `is_stable` and `real_roots`": lambda: (is_stable(rows), real_roots(rows)),
        "class and real roots: quartics by NumPy": lambda: quartic_classes(*a),
    }


def _rows(inputs: dict[str, Array], repeats: int) -> list[tuple[str, ...]]:
    seconds = {name: best(works(a), repeats) for name, a in inputs.items()}
    points = next(iter(inputs.values())).shape[1]
    rows = []
    for work in next(iter(seconds.values())):
        cells = []
        for least in seconds.values():
            base = least[_EIGENVALUES] if "abscissa" in work or "factors" in work else least[_BASELINE_CLASS]
            cells += [f"{1e9 * least[work] / points:.0f}", f"{base / least[work]:.1f}"]
        rows.append((work, *cells))
    return rows


def report(asked: Asked) -> str:
    """The report in Markdown."""
    points, repeats = asked.of(_POINTS, _POINTS // 10), 2 if asked.quick else _REPEATS
    inputs = {"two-mass-skate designs": designs(points), "normal coefficients": random(points)}
    header = ["work", *(cell for name in inputs for cell in (f"{name}, ns a point", "times the eigenvalues' rate"))]
    errors = []
    for name, a in inputs.items():
        found = quartic_factors(*a)
        error = float(np.max(backward_error(a.T, found.roots)))
        errors.append(f"{name} {error:.1e} ({found.fallbacks} by eigenvalues)")
    return page(
        "Roots and classes of many quartics",
        asked,
        f"{points} quartics from coefficients in memory, one thread, interleaved, the best of {repeats} rounds:",
        table(header, _rows(inputs, repeats)),
        "The rate of the eigenvalues includes building the companion matrices. Largest backward error of the factors: "
        f"{', '.join(errors)}.",
    )
