"""The models that come with tmsopt, by name; a user's own may not take one of these."""

import copyreg
from typing import Any

from tmsopt.models.bicycles.tms import tms
from tmsopt.models.bicycles.whipple import whipple
from tmsopt.models.model import Model

MODELS = {model.name: model for model in (tms, whipple)}
"""Models that a problem file can name."""


def named(name: str) -> Model:
    """The model of a name that a problem file can use.

    Example:
        >>> tmsopt.models.named("tms") is tmsopt.models.tms
        True

    More: docs/reference/problem_file.md
    """
    return MODELS[name]


def _pickled(model: Model) -> Any:
    """By name or origin where it has one: in another process it is that process's own, and no copy of this."""
    if MODELS.get(model.name) is model:
        return named, (model.name,)
    if model.origin is not None:
        return model.origin
    return model.__reduce_ex__(2)


copyreg.pickle(Model, _pickled)
