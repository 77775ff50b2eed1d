"""Every exceptional point of the paper, proved: its radius, digits and time: ``python -m benchmarks.proofs``."""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import click

from benchmarks.reports.tables import keep, kept, origin, table
from tmsopt import Problem, Proof, Solution, models, solve
from tmsopt.proofs.proof import prove_design

DIGITS = (30, 60)
_REPEATS = 3

_HEIGHTS = {"zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1, "chi_H": 1.0}
_ROOT2 = math.sqrt(2)
_TILT = math.atan(15 / 4 - 75 * _ROOT2 / 32)
_FR = 3 * math.sqrt(110 * _ROOT2 - 120) / 8
_MACHINE = {"zeta_B": -1.158, "zeta_H": -0.526}


@dataclass(frozen=True)
class Point:
    """A point of the paper: where it is printed, the pattern, what is held and about where it is."""

    place: str
    pattern: str
    held: Mapping[str, float]
    near: Mapping[str, float]

    def problem(self) -> Problem:
        """The pattern is located in a box a fifth of its numbers wide, either way."""
        free = {n: (x - abs(x) / 5, x + abs(x) / 5) for n, x in self.near.items()}
        return Problem(models.tms, fixed=self.held, free=free, start=self.near, locate=self.pattern)


POINTS = (
    Point("Table 1, row 1; Figs. fig00, fig1", "EP4", _HEIGHTS, {"Fr": 2.24, "chi_B": 1.41, "lambda_s": 0.41}),
    Point("Table 1, row 2", "2EP2", {**_HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.26, "chi_B": 1.41}),
    Point("Table 1, row 3", "CEP2", {**_HEIGHTS, "lambda_s": _TILT + 0.8}, {"Fr": 4.1, "chi_B": 1.41}),
    Point("Table 1, Fr_c of row 1", "weave", {**_HEIGHTS, "lambda_s": _TILT, "chi_B": _ROOT2}, {"Fr": 1.6}),
    Point("Table 1, Fr_c of row 2", "weave", {**_HEIGHTS, "lambda_s": _TILT - 0.05, "chi_B": _ROOT2}, {"Fr": 1.5}),
    Point("Table 1, Fr_c of row 3", "weave", {**_HEIGHTS, "lambda_s": _TILT + 0.8, "chi_B": _ROOT2}, {"Fr": 3.9}),
    Point(
        "optimised benchmark, ω0 not held", "EP4", {**_HEIGHTS, "chi_H": 1.02, "mu": 20.846267012761306},
        {"Fr": 2.34, "chi_B": 1.19, "lambda_s": 0.85},
    ),
    Point("fold, Fr = √5", "2EP2", {**_HEIGHTS, "lambda_s": 0.4051965261014}, {"Fr": 2.24, "chi_B": 1.41}),
    Point("Fig. fig00, Fr_EP4 + 0.5", "2EP2", {**_HEIGHTS, "Fr": _FR + 0.5}, {"chi_B": 1.41, "lambda_s": 0.24}),
    Point("Fig. fig00, Fr_EP4 + 0.5", "CEP2", {**_HEIGHTS, "Fr": _FR + 0.5}, {"chi_B": 1.41, "lambda_s": 0.87}),
    Point("Fig. fig2, left", "EP3", {**_HEIGHTS, "chi_B": _ROOT2 - 0.1}, {"Fr": 2.02, "lambda_s": 0.2}),
    Point("Fig. fig2, right", "EP3", {**_HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 2.185, "chi_B": 1.515}),
    Point("Fig. fig2, right", "EP3", {**_HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 2.086, "chi_B": 1.339}),
    Point("Fig. fig2, right", "2EP2", {**_HEIGHTS, "lambda_s": _TILT - 0.18}, {"Fr": 3.97, "chi_B": 1.41}),
    Point("spire at the tilt of row 2", "EP3", {**_HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.2352, "chi_B": 1.4283}),
    Point("spire at the tilt of row 2", "EP3", {**_HEIGHTS, "lambda_s": _TILT - 0.05}, {"Fr": 2.2171, "chi_B": 1.4025}),
    Point(
        "dual of row 1", "EP4", {**_HEIGHTS, "zeta_B": -0.2, "zeta_H": -0.4},
        {"Fr": _FR / _ROOT2, "chi_B": 0.707, "lambda_s": -0.215},
    ),
    Point(
        "experimental machine", "EP4", {**_MACHINE, "chi_H": 0.921, "chi_B": 1.526},
        {"Fr": 1.38, "mu": 0.98, "lambda_s": 0.244},
    ),
    Point(
        "experimental machine, chi_H = 1", "EP3", {**_MACHINE, "mu": 0.1, "chi_H": 1.0, "chi_B": 1.526},
        {"Fr": 1.31, "lambda_s": 0.17},
    ),
)  # fmt: skip
"""Points of the text, Table 1 and the figures."""


@dataclass(frozen=True)
class Row:
    """A proof, and the best of some times."""

    place: str
    proof: Proof
    seconds: float


def rows(digits: int) -> Iterator[Row]:
    """Every point; the optimised benchmark with ω0 = −1 on both branches; an EP4 in fractions."""
    for point in POINTS:
        solution = solve(point.problem())
        yield _timed(point.place, solution, solution.parameters, digits)
    yield from _benchmark(digits)
    fractions = Problem(
        models.tms,
        fixed={
            "Fr": 17 / 12, "mu": 0.1, "chi_B": 2.0, "chi_H": 1.0, "zeta_B": -2.0, "zeta_H": -0.5,
            "lambda_s": math.atan(17 / 48),
        },
    )  # fmt: skip
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
    seconds = math.inf
    for _ in range(_REPEATS):
        began = time.perf_counter()
        proof = prove_design(solution.problem, parameters, solution.structure, digits, exact)
        seconds = min(seconds, time.perf_counter() - began)
    return Row(place, proof, seconds)


def section(command: str) -> str:
    """The report in Markdown."""
    found = {digits: list(rows(digits)) for digits in DIGITS}
    first = found[DIGITS[0]]
    lines = ["## Proofs of the paper's exceptional points", "", origin(command), ""]
    for digits, proved in found.items():
        count, largest = sum(r.proof.proved for r in proved), max(r.proof.radius for r in proved)
        lines.append(
            f"- {digits} digits: {count} of {len(proved)} proved, radii at most {largest:.0e}, times at most "
            f"{1e3 * max(r.seconds for r in proved):.0f} ms"
        )
    lines += ["", f"At {DIGITS[0]} digits, the best of {_REPEATS} times each:", ""]
    cells = [
        (
            r.place,
            r.proof.pattern if r.proof.proved else f"{r.proof.pattern}: not proved, {r.proof.reason}",
            _first(r.proof),
            f"{r.proof.radius:.0e}" if r.proof.radius else "exact",
            f"{r.proof.uniqueness:.1g}" if math.isfinite(r.proof.uniqueness) else "–",
            f"{r.proof.distance:.0e}" if r.proof.moved else "–",
            _answers(r.proof),
            f"{1e3 * r.seconds:.0f} ms",
        )
        for r in first
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
    lines += [table(header, cells), ""]
    lines.append(
        "The radius is that of the largest ball among the parameters and factor coefficients that are solved for; the "
        "decimals given are rounded to the digits asked for and five more."
    )
    return "\n".join(lines) + "\n"


def _first(proof: Proof) -> str:
    value = proof.abscissa.value if proof.abscissa else "–"
    return f"{value[:24]}…" if len(value) > 24 else value


def _answers(proof: Proof) -> str:
    words = {True: "yes", False: "no", None: "not told"}
    return f"{words[proof.stable.holds]}, {words[proof.heavily_damped.holds]}"


@click.command()
@kept
def main(output: Path) -> None:
    """Prove every exceptional point of the paper, print the table and keep it."""
    text = section("python -m benchmarks.proofs")
    click.echo(text)
    keep(output, "proofs", text)


if __name__ == "__main__":
    main()
