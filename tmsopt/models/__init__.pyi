from .bicycle_files import (
    Bicycle as Bicycle, problem_text as problem_text, read_bicycle as read_bicycle, write_bicycle as write_bicycle,
)
from .bicycles.tms import (
    GRAVITY as GRAVITY, copo as copo, from_si as from_si, matrices as matrices, tms as tms, to_si as to_si,
)
from .bicycles.whipple import whipple as whipple
from .bicycles.whipple_quantities import canonical as canonical, spin as spin
from .built_in import MODELS as MODELS, controlled as controlled, gain_names as gain_names, named as named
from .exact import decimal as decimal
from .inertia import INERTIAS as INERTIAS, inertia_margin as inertia_margin
from .model import (
    Model as Model, Parameter as Parameter, ParameterSet as ParameterSet, Quantity as Quantity, Range as Range,
    Values as Values, in_words_of as in_words_of, words_of as words_of,
)
from .names import CONSTANTS as CONSTANTS, FUNCTIONS as FUNCTIONS, TAKEN as TAKEN, latex as latex
from .stated.texts import Unfit as Unfit
from .stated.user_defined import (
    from_coefficients as from_coefficients, from_hamiltonian as from_hamiltonian, from_matrices as from_matrices,
)
