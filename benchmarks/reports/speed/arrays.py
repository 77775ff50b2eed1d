"""Expressions over a grid: the tape by NumPy and by numba, beside one design at a time and CasADi's own evaluation."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import click
import numpy as np

from benchmarks.reports.tables import keep, kept, origin
from tmsopt.charts.expressions import array_function
from tmsopt.design.expression import parse_value
from tmsopt.design.machine import engine_of
from tmsopt.design.problem import Problem
from tmsopt.models import Values, tms

EXPRESSIONS: Mapping[str, str] = {
    "coefficient a2": "a2",
    "quantity Fr_c": "Fr - Fr_c",
    "polynomial": "(Fr*lambda_s - 1)*(Fr + lambda_s) + Fr*lambda_s*(Fr - lambda_s)",
    "quotients and roots": "sqrt(1 + Fr*lambda_s)/(Fr + lambda_s) - max(Fr*lambda_s, 1)/sqrt(Fr + lambda_s)",
    "sine of both": "sin(Fr*lambda_s)*Fr + exp(-Fr*lambda_s)",
}
"""From what depends mostly on one axis to what depends on both throughout."""

_PROBLEM = Problem(
    model=tms,
    fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1, "chi_B": 1.4},
    free={"Fr": (0.1, 5.0), "lambda_s": (0.1, 1.4)},
)
_ROWS, _COLUMNS = 64, 2048  # a tile of a chart
_ALONE = 300  # designs evaluated one by one
_ROUNDS = 7


def rates(text: str) -> dict[str, float]:
    """Seconds per design of each way, the best of several interleaved rounds."""
    Fr, tilt = np.linspace(*_PROBLEM.free["Fr"], _COLUMNS)[None, :], np.linspace(*_PROBLEM.free["lambda_s"], _ROWS)
    columns = _PROBLEM.ordered({"Fr": Fr, "lambda_s": tilt[:, None]})
    function = array_function(_PROBLEM, {"x": text})
    settled = function.settled({n: v for n, v in columns.items() if n != "lambda_s"})
    expression = parse_value(text, _PROBLEM.vocabulary)
    symbols = {n: ca.SX.sym(n) for n in columns}
    written = expression.symbolic(Values(tms, _PROBLEM.parameter_set, symbols))
    casadi = ca.Function("x", [ca.vertcat(*symbols.values())], [written])
    matrix = np.stack([np.broadcast_to(v, (_ROWS, _COLUMNS)).ravel() for v in columns.values()])
    mapped = casadi.map(matrix.shape[1])
    designs = [dict(zip(columns, matrix[:, 997 * k % matrix.shape[1]].tolist(), strict=True)) for k in range(_ALONE)]

    def alone() -> None:
        for design in designs:
            expression(Values(tms, _PROBLEM.parameter_set, design))

    ways: dict[str, tuple[Callable[[], object], int]] = {
        "one at a time": (alone, _ALONE),
        "F(matrix)": (lambda: casadi(matrix), matrix.shape[1]),
        "F.map": (lambda: mapped(matrix), matrix.shape[1]),
        "numpy": (lambda: settled({"lambda_s": tilt[:, None]}, "numpy"), matrix.shape[1]),
    }
    if engine_of("auto") == "numba":
        ways["numba"] = (lambda: settled({"lambda_s": tilt[:, None]}, "numba"), matrix.shape[1])
    best = dict.fromkeys(ways, np.inf)
    for _ in range(_ROUNDS):
        for name, (way, count) in ways.items():
            start = time.perf_counter()
            way()
            best[name] = min(best[name], (time.perf_counter() - start) / count)
    return best


def section(command: str = "python -m benchmarks.arrays", quick: bool = False) -> str:
    """Designs per second and ratios in Markdown."""
    texts = dict(list(EXPRESSIONS.items())[:2]) if quick else EXPRESSIONS
    found = {name: rates(text) for name, text in texts.items()}
    engines = [e for e in ("numpy", "numba") if e in next(iter(found.values()))]
    others = ["one at a time", "F(matrix)", "F.map"]
    head = ["expression", *(f"{e}, designs/s" for e in engines), *(f"{e} : {o}" for e in engines for o in others)]
    lines = [" | ".join(head), " | ".join("---" for _ in head)]
    for name, best in found.items():
        cells = [f"{1 / best[e]:.2g}" for e in engines] + [f"{best[o] / best[e]:.0f}" for e in engines for o in others]
        lines.append(" | ".join([name, *cells]))
    said = (
        f"A grid of {_COLUMNS} by {_ROWS} designs. Ratios are times divided: how many times faster the tape is than "
        "the formula on one design at a time, than CasADi's function on a matrix, and than its map. All are best of "
        f"{_ROUNDS} interleaved rounds on one core."
    )
    table = "\n".join(f"| {line} |" for line in lines)
    return "\n\n".join(["## Expressions over a grid", origin(command), said, table]) + "\n"


@click.command()
@kept
def main(output: Path) -> None:
    """Measure and keep the table."""
    text = section()
    click.echo(text)
    keep(output, "arrays", text)


if __name__ == "__main__":
    main()
