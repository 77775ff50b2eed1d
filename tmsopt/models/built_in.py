"""The models of tmsopt by name; models of your own need other names."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

from tmsopt.models.bicycles.feedback import FEEDBACK, add_feedback, feedback_names, native_name
from tmsopt.models.bicycles.tms import CONTROLLABLE as TMS
from tmsopt.models.bicycles.whipple import CONTROLLABLE as WHIPPLE
from tmsopt.models.model import Model

_BICYCLES = {bicycle.model.name: bicycle for bicycle in (TMS, WHIPPLE)}
MODELS = {name: bicycle.model for name, bicycle in _BICYCLES.items()}
"""Models that a problem file can name."""


def named(name: str) -> Model:
    """The model with a name that a problem file can use.

    Example:
        >>> tmsopt.models.named("tms") is tmsopt.models.tms
        True

    More: docs/reference/problem_file.md
    """
    return MODELS[name]


def controlled(model: Model, names: Iterable[str]) -> Model:
    """The bicycle with a controller that has the gains among `names`, or without one; other models unchanged.

    Example:
        >>> robot = tmsopt.models.controlled(tmsopt.models.whipple, ["k_phidot", "lag"])
        >>> print(robot.degree, *robot.sets[0].names[-5:])  # a lag adds a state
        5 k_phi k_phidot k_delta k_deltadot lag

    More: docs/how_to/feedback.md
    """
    built_in = MODELS.get(model.name) is model or (model.origin is not None and model.origin[0] is _add_controller)
    return _add_controller(model.name, feedback_names(names)) if built_in and gain_names(model.name) else model


def gain_names(name: str) -> tuple[str, ...]:
    """Names that [feedback] accepts for a model, in the units of each parameter set; empty unless it is a bicycle.

    Example:
        >>> tmsopt.models.gain_names("whipple")[:4]
        ('k_phi', 'k_phidot', 'k_delta', 'k_deltadot')

    More: docs/how_to/feedback.md
    """
    if name not in _BICYCLES:
        return ()
    return (*FEEDBACK, *(native_name(n) for n in FEEDBACK if MODELS[name].sets[0].rate is None))


@cache
def _add_controller(name: str, names: tuple[str, ...]) -> Model:
    if not names:
        return MODELS[name]
    return replace(add_feedback(_BICYCLES[name], names), origin=(_add_controller, (name, names)))
