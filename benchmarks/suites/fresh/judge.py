"""The verdict on an answer: what it claims, against the reference and 50 digits.

In: a problem, its reference and what the program said. Out: a `Verdict`.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mpmath

from benchmarks.suites.fresh.formulas import DIGITS, MANY_DIGITS, exact
from benchmarks.suites.fresh.points import polish
from benchmarks.suites.fresh.problem import Problem, assign, measure_exactly, polynomial
from benchmarks.suites.fresh.reference import FEASIBLE, Reference

SECONDS = 600
"""After which a problem counts as unanswered."""

BEATEN = 1e-6
"""Relative difference from which a better design makes an optimum false."""

SCATTER = 2e-3
"""Relative: more than doubles move a multiple root of four."""

MATCHED = 1e-12
"""To which the coefficients must match those of the claimed roots."""

KINDS = ("optimum", "value", "infeasible", "feasible", "proved", "complete")
"""Of false statements. *Value* is a number next to a design that is not that of the design."""

DENSE = 17
"""Cases by which a band with a range is measured; the file has every fourth."""


@dataclass(frozen=True)
class Verdict:
    """What an answer was worth.

    Attributes:
        answer: the status, or why there is none.
        answered: whether it was optimal or infeasible, or said which points there are.
        false: kind → what is false.
        doubtful: whether it said that a better one is likely.
        missed: whether the stored design misses a limit, and it said so.
    """

    answer: str
    answered: bool
    false: Mapping[str, str] = field(default_factory=dict)
    doubtful: bool = False
    missed: bool = False


def ask(problem: Problem, checkout: Path) -> dict[str, Any]:
    """What the command line of a checkout says: command → status and text."""
    commands = [["solve", "--json"]]
    if problem.sense == "locate":
        commands = [["solve", "--all", "--json"], ["prove", "--json"]]
    said: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "problem.toml").write_text(problem.text, encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": str(checkout)}
        for verb, *options in commands:
            command = [sys.executable, "-m", "tmsopt", verb, "problem.toml", *options]
            try:
                ran = subprocess.run(
                    command, cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS, check=False
                )
                said[verb] = {"status": ran.returncode, "out": ran.stdout, "error": ran.stderr[-2000:]}
            except subprocess.TimeoutExpired:
                said[verb] = {"status": None, "out": "", "error": "out of time"}
    return said


def judge(problem: Problem, known: Mapping[str, Any], said: Mapping[str, Any]) -> Verdict:
    """The verdict; `known` is what `__main__.known` found."""
    solved = _data(said["solve"])
    if solved is None:
        return Verdict(f"no answer: {said['solve']['error'].strip().splitlines()[-1:]}", False)
    if problem.sense == "locate":
        return _judge_points(problem, known["points"], solved, _data(said["prove"]) or {})
    return _judge_design(problem, Reference(**known), solved, said["solve"]["out"])


def _data(said: Mapping[str, Any]) -> dict[str, Any] | None:
    try:
        found = json.loads(said["out"])
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _judge_design(problem: Problem, best: Reference, data: Mapping[str, Any], text: str) -> Verdict:
    false: dict[str, str] = {}
    status, bad = data["status"], {}
    stated = problem if len(problem.cases) != DENSE else replace(problem, cases=problem.cases[::4])
    if status == "infeasible" and best.feasible:
        false["infeasible"] = f"{dict(best.design)} is feasible"
    if data.get("any_stable") is False and best.feasible and best.abscissa < 0:  # of those that meet the other limits
        false["proved"] = f"none is stable, but {dict(best.design)} is, by {best.abscissa:.3g}"
    if status == "optimal":
        claimed = float(data["objective"]["value"])
        real = measure_exactly(stated, data["parameters"])
        bad = {n: v for n, v in real.violations.items() if v > FEASIBLE}
        told = " ".join(
            [*(data.get("violations") or {}), *(data.get("missed_as_stored") or {}), *data.get("notes", ())]
        )
        if not all(name in told for name in bad):
            false["feasible"] = f"violated, relative: {bad}"
        upper = real.objective if stated is problem else measure_exactly(problem, data["parameters"]).objective
        scale = max(abs(claimed), 1e-3)
        apart = max(min(real.objective, upper) - claimed, claimed - max(real.objective, upper))
        realised = data.get("abscissa_realised")
        told_both = (  # the abscissa of a multiple root, and that of the doubles beside it
            problem.objective == "abscissa"
            and realised is not None
            and abs(realised - upper) <= BEATEN * scale
            and abs(realised - claimed) <= SCATTER * scale
            and any(root["multiplicity"] > 1 for root in data["roots"])
        )
        if apart > BEATEN * scale and not told_both and not _matches(stated, data):
            false["value"] = f"{claimed!r} is said, the design has {real.objective!r}"
        if stated is problem and realised is not None:
            off = abs(realised - real.abscissa)
            if off > 1e-6 * max(1, abs(realised)):
                false.setdefault("value", f"realised {realised!r} is said, the design has {real.abscissa!r}")
        if best.feasible and problem.sign * (claimed - best.value) > BEATEN * scale:
            false["optimum"] = f"{claimed!r} is said, {best.value!r} is at {dict(best.design)}"
    bound = data.get("bound") or {}
    if bound.get("proven") and bound.get("value") is not None and best.feasible:
        over = problem.sign * (bound["value"] - best.value)
        if over > 1e-9 * max(abs(best.value), 1e-3):
            false["proved"] = f"bound {bound['value']!r}, but {best.value!r} is at {dict(best.design)}"
    if bound.get("proven") and status == "infeasible" and best.feasible:
        false["proved"] = false["infeasible"]
    unseen = (data.get("starts") or {}).get("expected_unseen")
    doubtful = "likely" in text or (unseen is not None and unseen >= 0.5)
    return Verdict(status, status in ("optimal", "infeasible"), false, doubtful, bool(bad) and "feasible" not in false)


def _matches(problem: Problem, data: Mapping[str, Any]) -> bool:
    """Whether the claimed roots, with their multiplicities, have the coefficients of the stored design in a case."""
    with mpmath.workdps(DIGITS):
        roots: list[Any] = []
        for root in data["roots"]:
            roots += [mpmath.mpc(root["re"], root["im"])] * root["multiplicity"]
        for case in problem.cases:
            design = {n: exact(data["parameters"][n]) for n in problem.free}
            real = polynomial(problem.system, assign(problem, design, case, MANY_DIGITS))
            both = roots
            if len(roots) < len(real) - 1:
                both = roots + [mpmath.conj(r) for r in roots if r.imag]
            if len(both) == len(real) - 1:
                said, sizes = _product(both), _product([-abs(r) for r in both])
                if all(abs(c / real[0] - d) <= MATCHED * abs(e) for c, d, e in zip(real, said, sizes, strict=True)):
                    return True
        return False


def _product(roots: Sequence[Any]) -> list[Any]:
    found = [mpmath.mpf(1)]
    for root in roots:
        found = [a - root * b for a, b in zip([*found, 0], [0, *found], strict=True)]
    return found


def _is_claim(solution: Mapping[str, Any]) -> bool:
    """Whether a solution is said to be an exceptional point."""
    words = json.dumps([solution.get("structure"), solution.get("notes")])
    semisimple = solution.get("defective") is False or "semisimple" in words or "diabolic" in words
    return solution.get("status", "optimal") == "optimal" and not semisimple


def _judge_points(
    problem: Problem, points: Sequence[Mapping[str, float]], data: Mapping[str, Any], proof: Mapping[str, Any]
) -> Verdict:
    false: dict[str, str] = {}
    span = dict(zip(problem.free, problem.box[:, 1] - problem.box[:, 0], strict=True))
    said = [s for s in data.get("solutions", [data]) if _is_claim(s)]
    for solution in said:
        here = {n: solution["parameters"][n] for n in problem.free}
        point = polish(problem, here)
        away = max(abs(float(point.parameters[n]) - here[n]) / span[n] for n in span) if point else 1.0
        if away > 1e-7 or not point or not point.defective:
            words = f"{here}: {'semisimple or none' if not point or not point.defective else f'{away:.1g} off'}"
            false["proved" if solution.get("proved") else "optimum"] = words
    missing = [p for p in points if not any(_near(p, s["parameters"], span) for s in said)]
    if data.get("complete") and missing:
        false["complete"] = f"missing: {missing}"
    if not said and points and data.get("status") == "infeasible":
        false["infeasible"] = f"there is {points[0]}"
    if proof.get("proved"):
        enclosure = {n: proof["parameters"][n] for n in problem.free}
        point = polish(problem, {n: e["value"] for n, e in enclosure.items()})
        with mpmath.workdps(DIGITS):
            inside = point and all(
                abs(point.parameters[n] - exact(e["value"])) <= exact(e["radius"]) + mpmath.mpf("1e-48")
                for n, e in enclosure.items()
            )
        if not inside or not point or not point.defective:
            false["proved"] = f"prove: {enclosure}"
    return Verdict(f"{len(said)} of {len(points)} points", bool(said) or not points or "complete" in data, false)


def _near(point: Mapping[str, float], other: Mapping[str, float], span: Mapping[str, float]) -> bool:
    return all(abs(point[n] - other[n]) <= 1e-5 * span[n] for n in span)
