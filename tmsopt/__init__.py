"""tmsopt: self-stable bicycles under your own constraints, and exceptional points of small dissipative systems."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tmsopt import laws, models, roots
    from tmsopt.certificates.certify import certify
    from tmsopt.charts.chart import Chart, chart, open_chart
    from tmsopt.critical_speeds.speeds import Speeds, speeds
    from tmsopt.design.files import load
    from tmsopt.design.problem import Problem
    from tmsopt.design.solution import NotSolved, Solution
    from tmsopt.diagnosis.diagnosis import Diagnosis, diagnose
    from tmsopt.errors import InputError
    from tmsopt.explanation.explain import Explanation, explain
    from tmsopt.explanation.optimality import Optimality, optimality
    from tmsopt.fronts.front import Front
    from tmsopt.fronts.pareto import pareto
    from tmsopt.margins.nearest import Nearest, Robustness, nearest, robustness
    from tmsopt.models.bicycle_files import Bicycle, read_bicycle, write_bicycle
    from tmsopt.paper.compare import Comparison, compare
    from tmsopt.proofs.proof import Proof
    from tmsopt.proofs.prove import prove
    from tmsopt.solver.all_designs import Every, solve_all
    from tmsopt.solver.solve import solve
    from tmsopt.studies.load import load_study
    from tmsopt.studies.monte_carlo import monte_carlo
    from tmsopt.studies.run import Results, run_study
    from tmsopt.studies.samples import latin_hypercube, sobol
    from tmsopt.studies.study import Study, over_grid
    from tmsopt.tracing.branch import Branch, Trace
    from tmsopt.tracing.domain import Domain, domain
    from tmsopt.tracing.swallowtail import Swallowtail, swallowtail
    from tmsopt.tracing.trace import trace

__version__ = "0.1.0"

__all__ = [
    "Bicycle",
    "Branch",
    "Chart",
    "Comparison",
    "Diagnosis",
    "Domain",
    "Every",
    "Explanation",
    "Front",
    "InputError",
    "Nearest",
    "NotSolved",
    "Optimality",
    "Problem",
    "Proof",
    "Results",
    "Robustness",
    "Solution",
    "Speeds",
    "Study",
    "Swallowtail",
    "Trace",
    "certify",
    "chart",
    "compare",
    "diagnose",
    "domain",
    "explain",
    "latin_hypercube",
    "laws",
    "load",
    "load_study",
    "models",
    "monte_carlo",
    "nearest",
    "open_chart",
    "optimality",
    "over_grid",
    "pareto",
    "prove",
    "read_bicycle",
    "robustness",
    "roots",
    "run_study",
    "sobol",
    "solve",
    "solve_all",
    "speeds",
    "swallowtail",
    "trace",
    "write_bicycle",
]

# Imported when first used, so that `tmsopt --help` need not wait for CasADi.
_HOMES = {
    "Bicycle": "tmsopt.models.bicycle_files",
    "Branch": "tmsopt.tracing.branch",
    "Chart": "tmsopt.charts.chart",
    "Comparison": "tmsopt.paper.compare",
    "Diagnosis": "tmsopt.diagnosis.diagnosis",
    "Domain": "tmsopt.tracing.domain",
    "Explanation": "tmsopt.explanation.explain",
    "Front": "tmsopt.fronts.front",
    "InputError": "tmsopt.errors",
    "Nearest": "tmsopt.margins.nearest",
    "NotSolved": "tmsopt.design.solution",
    "Optimality": "tmsopt.explanation.optimality",
    "Problem": "tmsopt.design.problem",
    "Proof": "tmsopt.proofs.proof",
    "Results": "tmsopt.studies.run",
    "Robustness": "tmsopt.margins.nearest",
    "Solution": "tmsopt.design.solution",
    "Speeds": "tmsopt.critical_speeds.speeds",
    "Study": "tmsopt.studies.study",
    "Swallowtail": "tmsopt.tracing.swallowtail",
    "Trace": "tmsopt.tracing.branch",
    "certify": "tmsopt.certificates.certify",
    "chart": "tmsopt.charts.chart",
    "compare": "tmsopt.paper.compare",
    "diagnose": "tmsopt.diagnosis.diagnosis",
    "domain": "tmsopt.tracing.domain",
    "explain": "tmsopt.explanation.explain",
    "latin_hypercube": "tmsopt.studies.samples",
    "load": "tmsopt.design.files",
    "load_study": "tmsopt.studies.load",
    "monte_carlo": "tmsopt.studies.monte_carlo",
    "nearest": "tmsopt.margins.nearest",
    "open_chart": "tmsopt.charts.chart",
    "optimality": "tmsopt.explanation.optimality",
    "over_grid": "tmsopt.studies.study",
    "pareto": "tmsopt.fronts.pareto",
    "prove": "tmsopt.proofs.prove",
    "read_bicycle": "tmsopt.models.bicycle_files",
    "robustness": "tmsopt.margins.nearest",
    "run_study": "tmsopt.studies.run",
    "sobol": "tmsopt.studies.samples",
    "solve": "tmsopt.solver.solve",
    "solve_all": "tmsopt.solver.all_designs",
    "Every": "tmsopt.solver.all_designs",
    "speeds": "tmsopt.critical_speeds.speeds",
    "swallowtail": "tmsopt.tracing.swallowtail",
    "trace": "tmsopt.tracing.trace",
    "write_bicycle": "tmsopt.models.bicycle_files",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in __all__:
        return import_module(f"tmsopt.{name}")
    raise AttributeError(f"module 'tmsopt' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
