"""Typical uses, as README and docs/reference/python.md have them: type checkers and Python both run this file, from the root."""

from typing import Any, assert_type

from matplotlib.axes import Axes

import tmsopt

problem = tmsopt.Problem(
    model=tmsopt.models.tms,
    fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1},
    free={"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.01, 1.5)},
    constraints={"trail": "nu_H >= 0.02"},
    minimize="abscissa",
)
design = assert_type(tmsopt.solve(problem, starts=16, seed=1), tmsopt.Solution)
assert_type(design.parameters["Fr"], float)
assert_type(design.stable, bool | None)
assert_type(design.structure, str)
assert_type(design.bound.proven, bool)
assert_type(str(design), str)
assert_type(design.report(full=True), str)
assert_type(design.to_json(), dict[str, Any])

try:
    tmsopt.solve(problem, starts=1, stability=0, near={"Fr": 2.0})
except tmsopt.NotSolved as stopped:
    assert_type(stopped.solution, tmsopt.Solution)

assert_type(tmsopt.prove(design).proved, bool)
assert_type(tmsopt.prove(design, digits=40).parameters["chi_B"].value, str)
assert_type(tmsopt.compare(design).differences, dict[str, float])
assert_type(tmsopt.speeds(design).weave, tuple[float, ...])
ridden = assert_type(tmsopt.simulate(design, lean=5, push=0.001), tmsopt.Simulation)
assert_type([m.settling for m in ridden.measures], list[float])
assert_type(ridden["phi"][0], float)
print(design.response(lean=5).to_frame().head())
assert_type(tmsopt.robustness(design).radius, float)
assert_type(tmsopt.growth(design).stable, tuple[tuple[float, float], ...])
assert_type(tmsopt.explain(design, resolve=False).warnings, tuple[str, ...])
for root in tmsopt.diagnose(design):
    assert_type(root.partial, tuple[int, ...])

chart = assert_type(tmsopt.chart("problems/chart.toml", points=(20, 15)), tmsopt.Chart)
assert_type(chart.shares, dict[str, float])
print(chart.to_xarray()["abscissa"].min())
curves = assert_type(tmsopt.trace(tmsopt.load("problems/chart.toml"), "EP2", starts=4), tmsopt.Trace)
print(curves.to_frame().head())
assert_type([event.parameters["Fr"] for event in curves.events], list[float])

study = assert_type(tmsopt.over_grid(problem, {"mu": [0.1, 0.2]}, starts=8), tmsopt.Study)
print(tmsopt.run_study(study, workers=1).to_frame()["abscissa"])

absorber = tmsopt.models.from_matrices(
    M=[[1, 0], [0, "mu"]], D=[["c", "-c"], ["-c", "c"]], K=[["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]
)
best = tmsopt.solve(tmsopt.Problem(absorber, {"mu": 0.1}, {"w": (0.5, 2), "c": (0, 1)}, minimize="abscissa"))
assert_type(best.abscissa, float)
print(len(assert_type(tmsopt.explore(best), tmsopt.Explorer).html))


def pictures() -> Axes:
    """What is drawn is Axes, whoever draws."""
    assert_type(curves.plot(), Axes)
    return design.plot()
