"""Worst cases, and limits in conflict, as lines for a reader."""

import math

from tmsopt.design.cases import Case
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Solution
from tmsopt.models import ParameterSet
from tmsopt.report.text import number
from tmsopt.units import reading


def bound_lines(solution: Solution) -> list[str]:
    """What no design of the box can beat, and how that is known."""
    bound = solution.bound
    search = f"branch and bound with {bound.solver}, {bound.nodes} nodes, {bound.seconds:.1f} s"
    floating = f"a floating-point proof, feasibility tolerance {bound.tolerance:.0e}"
    kind = floating if bound.tolerance else "a proof without a tolerance"
    if solution.status == "infeasible":
        return [f"proved: no design in the box satisfies all constraints ({search}); {kind}"] if bound.proven else []
    if not math.isfinite(bound.value):
        return [f"bound: none found in time ({search})"] if bound.solver else []
    side = "above" if solution.problem.sense == "maximize" else "below"
    lines = [f"bound: no design in the box is {side} {number(bound.value)} ({bound.method}); gap {bound.gap:.1e}"]
    if bound.method == bound.solver.lower():
        lines.append(f"       {search}; {kind}")
    elif bound.solver:
        lines.append(f"       {search} found none better in time")
    return lines


def case_lines(solution: Solution) -> list[str]:
    """The worst case, and what is known of all of them."""
    if solution.worst is None:
        return []
    of = solution.problem.parameter_set
    lines = [f"worst case: {_place(of, solution.worst)}; abscissa, roots and structure are those there"]
    if solution.least_damped is not None and solution.least_damped != solution.worst:
        lines.append(f"least damped case: {_place(of, solution.least_damped)}; the damping ratio is that there")
    lines.append("parameters, loads and the other quantities are those of the nominal design")
    cover = solution.cover
    if cover is not None:
        means = f"by interval arithmetic on {cover.boxes} boxes" if cover.proven else "looked for, not proven"
        lines.append(f"every case: abscissa at most {number(cover.limit)}, {means}")
    return lines


def _place(of: ParameterSet, case: Case) -> str:
    """Values of scenarios and errors of parameters in a case."""
    at = [f"{n} = {_short(of, n, v)}" for n, v in case.at.items()]
    at += [f"{n} {'+' if v >= 0 else '−'} {_short(of, n, abs(v))}" for n, v in case.offset.items()]
    return ", ".join(at)


def relaxation_lines(solution: Solution) -> list[str]:
    """What is in conflict, and what frees it."""
    relaxation = solution.relaxation
    if relaxation is None or not relaxation.amounts:
        return []
    problem = solution.problem
    lines = [f"in conflict: {', '.join(relaxation.conflict) or ', '.join(relaxation.amounts)}"]
    moves = [_move(problem, name, amount) for name, amount in relaxation.amounts.items()]
    lines.append(f"smallest relaxation found: {'; '.join(moves)}")
    single = {n: a for n, a in relaxation.alone.items() if relaxation.amounts.keys() != {n}}
    lines += [f"  or alone: {_move(problem, name, amount)}" for name, amount in single.items()]
    return lines


def _move(problem: Problem, name: str, amount: float) -> str:
    """A limit moved, in words, rounded up so that it suffices."""
    if not math.isfinite(amount):  # at the edge of where its sides exist
        return f"{name} ({problem.constraints.get(name, name)}), which has no value there"
    parameter, _, end = name.partition(".")
    if name in problem.constraints or parameter not in problem.free:
        return f"{name} ({problem.constraints.get(name, name)}) by {_up(amount)}"
    of = problem.parameter_set
    value, unit = reading(amount, of[parameter].unit)
    direction = "up" if end == "max" else "down"
    return f"{name} {direction} by {_up(value)}{'' if unit == '1' else ' ' + unit}"


def _up(amount: float) -> str:
    """Six digits, rounded away from zero."""
    if amount == 0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(abs(amount))) - 5)
    return f"{math.copysign(math.ceil(abs(amount) / step) * step, amount):.6g}"


def _short(of: ParameterSet, name: str, value: float) -> str:
    number_, unit = reading(value, of[name].unit)
    return f"{number_:.9g}{'' if unit == '1' else ' ' + unit}"
