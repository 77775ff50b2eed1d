"""Models whose roots can be designed: tms, whipple, and those a user states.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `model` first: what a model is; then
`tms`.
"""

import copyreg
from typing import Any

from tmsopt.models.bicycle_files import Bicycle, problem_text, read_bicycle, write_bicycle
from tmsopt.models.exact import decimal
from tmsopt.models.model import Model, Parameter, ParameterSet, Quantity, Range, Values
from tmsopt.models.names import CONSTANTS, FUNCTIONS, TAKEN, latex
from tmsopt.models.tms import GRAVITY, copo, from_si, matrices, tms, to_si
from tmsopt.models.user_defined import Unfit, from_coefficients, from_matrices
from tmsopt.models.whipple import canonical, whipple
from tmsopt.models.whipple_quantities import spin

MODELS = {tms.name: tms, whipple.name: whipple}
"""Models that a problem file can name."""

__all__ = [
    "CONSTANTS", "FUNCTIONS", "GRAVITY", "MODELS", "TAKEN", "Bicycle", "Model", "Parameter", "ParameterSet",
    "Quantity", "Range", "Unfit", "Values", "canonical", "copo", "decimal", "from_coefficients", "from_matrices",
    "from_si", "latex", "matrices", "named", "problem_text", "read_bicycle", "spin", "tms", "to_si", "whipple",
    "write_bicycle",
]  # fmt: skip


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
