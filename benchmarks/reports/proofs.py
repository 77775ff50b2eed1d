"""Every exceptional point of the paper, proved: its radius, digits and time."""

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from benchmarks.reports.tables import Asked, duration, page, table
from benchmarks.suites import POINTS
from benchmarks.timing import best
from tmsopt import Problem, Proof, Solution, models, solve
from tmsopt.proofs import prove_design

DIGITS = (30, 60)
_REPEATS = 3


class Row(NamedTuple):
    """A proof, and the best of some times."""

    place: str
    proof: Proof
    seconds: float


def rows(digits: int, points: int) -> Iterator[Row]:
    """The points; the optimised benchmark with ω0 = −1 on both branches; an EP4 in fractions."""
    for point in POINTS[:points]:
        solution = solve(point.problem())
        yield _timed(point.place, solution, solution.parameters, digits)
    yield from _benchmark(digits)
    fractions = Problem(
        models.tms,
        fixed={
            "Fr": 17 / 12,
            "mu": 0.1,
            "chi_B": 2.0,
            "chi_H": 1.0,
            "zeta_B": -2.0,
            "zeta_H": -0.5,
            "lambda_s": math.atan(17 / 48),
        },
    )
    exact = {"Fr": Fraction(17, 12), "tan(lambda_s)": Fraction(17, 48)}
    solution = solve(fractions)
    yield _timed("EP4 in fractions", solution, solution.parameters, digits, exact)


def _benchmark(digits: int) -> Iterator[Row]:
    optimised = solve(
        Problem(
            models.tms,
            fixed={"chi_H": 1.02, "zeta_H": -0.2, "zeta_B": -0.4},
            free={"chi_B": (1.0, 3.0), "mu": (0.001, 100.0), "Fr": (0.01, 10.0), "lambda_s": (0.02, 1.5)},
            locate="EP4",
            constraints={"decay": "omega0 == -1"},
        )
    )
    yield _timed("optimised benchmark", optimised, optimised.parameters, digits)
    for branch in optimised.branches:
        why = f"its other solution, excluded by {', '.join(branch.excluded_by)}"
        yield _timed(why, optimised, branch.parameters, digits)


def _timed(
    place: str,
    solution: Solution,
    parameters: Mapping[str, float],
    digits: int,
    exact: Mapping[str, Fraction] | None = None,
) -> Row:
    work = partial(prove_design, solution.problem.posed, parameters, solution.structure, digits, exact)
    return Row(place, work(), best({place: work}, _REPEATS)[place])


def report(asked: Asked) -> str:
    """The report in Markdown."""
    found = {digits: list(rows(digits, asked.of(len(POINTS), 2))) for digits in DIGITS}
    said = [
        f"- {digits} digits: {sum(r.proof.proved for r in proved)} of {len(proved)} proved, radii at most "
        f"{max(r.proof.radius for r in proved):.0e}, times at most {duration(max(r.seconds for r in proved))}"
        for digits, proved in found.items()
    ]
    cells = [
        (
            r.place,
            r.proof.pattern if r.proof.proved else f"{r.proof.pattern}: not proved, {r.proof.reason}",
            _first(r.proof),
            f"{r.proof.radius:.0e}" if r.proof.radius else "exact",
            f"{r.proof.uniqueness:.1g}" if math.isfinite(r.proof.uniqueness) else "–",
            f"{r.proof.distance:.0e}" if r.proof.moved else "–",
            _answers(r.proof),
            duration(r.seconds),
        )
        for r in found[DIGITS[0]]
    ]
    header = (
        "point",
        "pattern",
        "abscissa",
        "radius",
        "unique within",
        "stored design off by",
        "stable, damped",
        "time",
    )
    return page(
        "Proofs of the paper's exceptional points",
        asked,
        "\n".join(said),
        f"At {DIGITS[0]} digits, the best of {_REPEATS} times each:",
        table(header, cells),
        "The radius is that of the largest ball among the parameters and factor coefficients that are solved for; the "
        "decimals given are rounded to the digits asked for and five more.",
    )


def _first(proof: Proof) -> str:
    value = proof.abscissa.value if proof.abscissa else "–"
    return f"{value[:24]}…" if len(value) > 24 else value


def _answers(proof: Proof) -> str:
    words = {True: "yes", False: "no", None: "not told"}
    return f"{words[proof.stable.holds]}, {words[proof.heavily_damped.holds]}"
