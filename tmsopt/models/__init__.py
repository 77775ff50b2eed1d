"""Models whose roots can be designed."""

import copyreg
from typing import Any

from tmsopt.models.model import Model, Parameter, ParameterSet, Quantity, Range, Values
from tmsopt.models.tms import tms
from tmsopt.models.user_defined import Unfit, from_coefficients, from_matrices
from tmsopt.models.whipple import whipple

MODELS = {tms.name: tms, whipple.name: whipple}
"""Models that a problem file can name."""

__all__ = [
    "MODELS",
    "Model",
    "Parameter",
    "ParameterSet",
    "Quantity",
    "Range",
    "Unfit",
    "Values",
    "from_coefficients",
    "from_matrices",
    "named",
    "tms",
    "whipple",
]


def named(name: str) -> Model:
    """The model of a name that a problem file can use."""
    return MODELS[name]


def _pickled(model: Model) -> Any:
    """By name or origin where it has one: in another process it is that process's own, and no copy of this."""
    if MODELS.get(model.name) is model:
        return named, (model.name,)
    if model.origin is not None:
        return model.origin
    return model.__reduce_ex__(2)


copyreg.pickle(Model, _pickled)
