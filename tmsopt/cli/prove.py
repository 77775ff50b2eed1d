"""The command that proves that a design exists."""

import sys
from pathlib import Path

import click

import tmsopt
from tmsopt.cli.common import (
    DONE,
    INFEASIBLE,
    NOT_CONVERGED,
    answer,
    file_argument,
    json_option,
    named,
    options,
    report_option,
    seed_option,
    starts_option,
    write_report,
)
from tmsopt.cli.terminal import shown

_EXAMPLES = """
\b
Examples:
  tmsopt prove problems/ep4.toml
  tmsopt prove problems/optimised_benchmark.toml --digits 60
  tmsopt prove problems/ep_set.toml --json
  tmsopt prove problems/ep4.toml --report proof.html
  tmsopt prove problems/heavily_damped.toml --exact "lambda_s=10 deg"

The problem is solved first. An interval Newton test (Krawczyk) then proves that exactly one design with the root
pattern that is located, or that the roots show, lies within the stated radius of the numbers given, and that the
stored design is this one up to rounding; stability and heavy damping follow by signs of balls. Where the test fails,
nothing is claimed, and the reason is given.

A number of FILE stands for the decimal it is written as, an angle for the decimal of its radians. --exact gives
another: a fraction, an angle in degrees, or tan(lambda_s).

Exit status: 0 proved, 2 bad input, 3 no design found, 4 not proved.
"""


@click.command(epilog=_EXAMPLES)
@file_argument
@json_option
@click.option("--digits", type=click.IntRange(1, 1000), default=30, show_default=True, help="Of every number.")
@click.option("--exact", multiple=True, metavar="NAME=VALUE", help="What a parameter is exactly, e.g. zeta_B=-1/3.")
@starts_option()
@seed_option
@report_option
def prove(
    file: Path, as_json: bool, digits: int, exact: tuple[str, ...], starts: int | None, seed: int, report: Path | None
) -> None:
    """Prove that the design which FILE asks for exists, and whether it is stable and heavily damped."""
    from tmsopt.problem import as_solvable

    given = named("--exact", exact, "zeta_B=-1/3")
    problem = as_solvable(file)
    asked = options(starts=starts, seed=seed)
    solution = tmsopt.solve(problem, throw=False, interruptible=False, progress=shown(), **asked)
    proof = tmsopt.prove(solution, digits, exact=given, progress=shown())
    heading = problem.heading | {"status": solution.status}
    answer(as_json, lambda: heading | proof.to_json(), lambda: tmsopt.report.proof_text(problem, proof))
    write_report(proof, report, file, seed=seed, design=solution)
    sys.exit(DONE if proof.proved else NOT_CONVERGED if solution.status == "optimal" else INFEASIBLE)
