"""Models whose roots can be designed: tms, whipple, and those a user states.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `model` first: what a model is; then
`bicycles`, and `built_in` for their names.
"""

from tmsopt.models.bicycle_files import Bicycle, problem_text, read_bicycle, write_bicycle
from tmsopt.models.bicycles.tms import GRAVITY, copo, from_si, matrices, tms, to_si
from tmsopt.models.bicycles.whipple import whipple
from tmsopt.models.bicycles.whipple_quantities import canonical, spin
from tmsopt.models.built_in import MODELS, controlled, gain_names, named
from tmsopt.models.exact import decimal
from tmsopt.models.inertia import INERTIAS, inertia_margin
from tmsopt.models.model import Model, Parameter, ParameterSet, Quantity, Range, Values, in_words_of, words_of
from tmsopt.models.names import CONSTANTS, FUNCTIONS, TAKEN, latex
from tmsopt.models.stated.hamiltonian import from_hamiltonian
from tmsopt.models.stated.texts import Unfit
from tmsopt.models.stated.user_defined import from_coefficients, from_matrices

__all__ = [
    "CONSTANTS",
    "FUNCTIONS",
    "GRAVITY",
    "INERTIAS",
    "MODELS",
    "TAKEN",
    "Bicycle",
    "Model",
    "Parameter",
    "ParameterSet",
    "Quantity",
    "Range",
    "Unfit",
    "Values",
    "canonical",
    "controlled",
    "copo",
    "decimal",
    "from_coefficients",
    "from_hamiltonian",
    "from_matrices",
    "from_si",
    "gain_names",
    "in_words_of",
    "inertia_margin",
    "latex",
    "matrices",
    "named",
    "problem_text",
    "read_bicycle",
    "spin",
    "tms",
    "to_si",
    "whipple",
    "words_of",
    "write_bicycle",
]
