"""The models that come with tmsopt, by name; a user's own may not take one of these."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

from tmsopt.models.bicycles.feedback import FEEDBACK, names_of, native_name, with_feedback
from tmsopt.models.bicycles.tms import STEERED as TMS
from tmsopt.models.bicycles.whipple import STEERED as WHIPPLE
from tmsopt.models.model import Model

_STEERED = {steered.model.name: steered for steered in (TMS, WHIPPLE)}
MODELS = {name: steered.model for name, steered in _STEERED.items()}
"""Models that a problem file can name."""


def named(name: str) -> Model:
    """The model of a name that a problem file can use.

    Example:
        >>> tmsopt.models.named("tms") is tmsopt.models.tms
        True

    More: docs/reference/problem_file.md
    """
    return MODELS[name]


def controlled(model: Model, names: Iterable[str]) -> Model:
    """A bicycle with the controller whose gains are among the names; without one if none is. Other models as they are.

    Example:
        >>> robot = tmsopt.models.controlled(tmsopt.models.whipple, ["k_phidot", "lag"])
        >>> print(robot.degree, *robot.sets[0].names[-5:])  # a lag is a state more
        5 k_phi k_phidot k_delta k_deltadot lag

    More: docs/how_to/feedback.md
    """
    own = MODELS.get(model.name) is model or (model.origin is not None and model.origin[0] is _controlled)
    return _controlled(model.name, names_of(names)) if own and gain_names(model.name) else model


def gain_names(name: str) -> tuple[str, ...]:
    """What [feedback] may name for a model of that name, in the units of each of its sets; nothing for no bicycle.

    Example:
        >>> tmsopt.models.gain_names("whipple")[:4]
        ('k_phi', 'k_phidot', 'k_delta', 'k_deltadot')

    More: docs/how_to/feedback.md
    """
    if name not in _STEERED:
        return ()
    return (*FEEDBACK, *(native_name(n) for n in FEEDBACK if MODELS[name].sets[0].rate is None))


@cache
def _controlled(name: str, names: tuple[str, ...]) -> Model:
    if not names:
        return MODELS[name]
    return replace(with_feedback(_STEERED[name], names), origin=(_controlled, (name, names)))
