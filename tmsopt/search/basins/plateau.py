"""Plateaus of the damping ratio: −1 wherever a root is real and positive."""

from dataclasses import replace

from tmsopt.problem.problem import Posed
from tmsopt.program.nlp import NLP
from tmsopt.search.multistart import distinct, search
from tmsopt.search.workspace import Workspace


def on_plateau(problem: Posed, ratio: float = -1.0) -> bool:
    """Whether the goal is a damping ratio alone, and this one is that of any design with a positive real root."""
    return (problem.maximize or "").strip() == "damping_ratio" and ratio <= -1


def off_plateau(work: Workspace, nlp: NLP, most: int) -> list[dict[str, float]]:
    """Designs of least abscissa, from so many starts, by coefficients: the plateau ends where a root is negative."""
    problem, part = (p.derive(minimize="abscissa", maximize=None) for p in (work.problem, work.part))
    other = replace(work, problem=problem, part=part, met=[])
    return [work.design_at(c.run.x) for c in distinct(search(other, other.formulate(nlp.cases), most))]
