"""`tmsopt prove`, `diagnose` and `compare`: what holds for a solution."""

from collections.abc import Mapping

import click

import tmsopt
from tmsopt.cli.answers import Reply
from tmsopt.cli.command import OnFile, WithIpopt, WithPage, WithPlot, WithSearch, option
from tmsopt.cli.ending import INFEASIBLE, NOT_CONVERGED, STATUSES
from tmsopt.cli.problems import take_nominal
from tmsopt.cli.terminal import progress_listener


class ProveCommand(WithSearch, WithPage, WithPlot, OnFile):
    """Prove that the solution of FILE exists, and whether it is stable and heavily damped.

    Examples:
      tmsopt prove problems/ep4.toml --report proof.html
      tmsopt prove problems/optimised_benchmark.toml --digits 60
      tmsopt prove problems/heavily_damped.toml --exact "lambda_s=10 deg"

    Exit status: 0 proved, 2 bad input, 3 no design found, 4 not proved.
    """

    digits: int = option("Digits of every number.", 30, type=click.IntRange(1, 1000))
    exact: Mapping[str, str] = option("Exact value of a parameter.", metavar="NAME=VALUE", example="zeta_B=-1/3")

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        problem = as_solvable(self.file)
        solution = tmsopt.solve(problem, throw=False, interruptible=False, **self.search)
        proof = tmsopt.prove(solution, self.digits, exact=self.exact, progress=progress_listener())
        status = 0 if proof.proved else NOT_CONVERGED if solution.status == "optimal" else INFEASIBLE
        data = problem.heading | {"status": solution.status} | proof.to_json()
        return Reply(proof, status, data, page={"design": solution})


class DiagnoseCommand(WithSearch, WithPlot, OnFile):
    """Show how each multiple root of the solution of FILE splits, and how fast.

    Examples:
      tmsopt diagnose problems/ep4.toml
      tmsopt diagnose problems/pt_pair.toml --plot splitting.png

    Exit status: 0 done, 2 bad input, 3 infeasible, 4 not converged.
    """

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        problem = as_solvable(self.file)
        solution = tmsopt.solve(problem, **self.search)
        found = tmsopt.diagnose(solution, progress=progress_listener())
        data = {"status": solution.status, "diagnoses": [diagnosis.to_json() for diagnosis in found]}
        if not found and self.plot:
            click.echo("--plot: nothing to draw, no root is multiple", err=True)
        shown = found or "no root of this solution is multiple, so none splits"
        without = "" if found else "plot"
        return Reply(found and found[0], 0, problem.heading | data, "full", shown=shown, without=without)


class CompareCommand(WithIpopt, WithPlot, OnFile):
    """Compare the optimum of FILE with the closed-form laws, and two formulations.

    Examples:
      tmsopt compare problems/ep4.toml
      tmsopt compare problems/optimised_benchmark.toml --json

    Exit status: 0 solved, 2 bad input, 3 infeasible, 4 not converged.
    """

    def run(self) -> Reply:
        from tmsopt.problem import as_solvable

        comparison = tmsopt.compare(take_nominal(as_solvable(self.file)), **self.search)
        return Reply(comparison, STATUSES[comparison.design.status])
