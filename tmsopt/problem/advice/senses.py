"""What was meant by an objective that asks for the worst of what it names."""

from tmsopt.problem.dependence import WORSE_DIRECTION, only_worsens
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS

_WORSE = {**{name: worse for name, worse in WORSE_DIRECTION.items() if name != ANGULAR_FREQUENCY}, RADIUS: -1.0}
"""Quantities of the roots of which there cannot be too much of the one and too little of the other."""

_OTHER = {"minimize": "maximize", "maximize": "minimize"}


def sense_notes(problem: Posed) -> tuple[str, ...]:
    """That an objective gets better only as stability gets worse, and what asks for the opposite."""
    text = (problem.minimize or problem.maximize or "").strip()
    if not problem.free or not any(only_worsens(problem, name, worse) for name, worse in _WORSE.items()):
        return ()
    other = f'{_OTHER[problem.sense]} = "{text}"'
    return (f"{problem.sense} {text} asks for the least stable design; {other} asks for the most stable one",)
