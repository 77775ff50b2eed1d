"""Classes of designs that are searched apart, such as forward and backward steer axis tilt."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.formulation.nlp import NLP

_THIN = 1e-9
"""Width of a side below which it is not worth a search of its own."""


@dataclass(frozen=True)
class Side:
    """A part of the box: one sign of one parameter, or all of it.

    Attributes:
        name: e.g. ``forward tilt``; empty for the whole box.
        problem: the problem on this part, to draw designs from.
    """

    name: str
    problem: Problem

    def holds(self, design: Mapping[str, float]) -> bool:
        """Whether a design, as far as it is given, is on this part."""
        return all(lower <= design.get(n, lower) <= upper for n, (lower, upper) in self.problem.free.items())

    def narrowed(self, nlp: NLP) -> NLP:
        """The NLP of the whole problem, on this part of the box."""
        return narrowed(nlp, self.problem)


def narrowed(nlp: NLP, problem: Problem) -> NLP:
    """An NLP with the box of a problem that has the same free parameters."""
    of = problem.parameter_set
    lower, upper = list(nlp.lower), list(nlp.upper)
    for k, (name, ends) in enumerate(problem.free.items()):
        lower[k], upper[k] = (float(np.tan(e)) if of[name].tangent else e for e in ends)
    return replace(nlp, lower=tuple(lower), upper=tuple(upper))


def sides(problem: Problem) -> tuple[Side, ...]:
    """The parts into which a parameter with two sides divides the box, positive values first."""
    of = problem.parameter_set
    for name, (lower, upper) in problem.free.items():
        names = of[name].sides
        if names is not None and lower < -_THIN and upper > _THIN:
            parts = ((names[1], (0.0, upper)), (names[0], (lower, 0.0)))
            return tuple(Side(side, _on(problem, name, ends)) for side, ends in parts)
    return (Side("", problem),)


def _on(problem: Problem, name: str, ends: tuple[float, float]) -> Problem:
    """The problem with a smaller range of one parameter, and its start where that fits."""
    inside = all(ends[0] <= v <= ends[1] for n, v in problem.start.items() if n == name)
    return replace(problem, free={**problem.free, name: ends}, start=problem.start if inside else {})
