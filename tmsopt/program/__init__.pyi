from .formulate import (
    formulate as formulate, formulate_by_factors as formulate_by_factors, formulate_matching as formulate_matching,
)
from .ipopt import forget_solvers as forget_solvers
from .nlp import NLP as NLP, Factor as Factor, Scale as Scale, objective_size as objective_size, scale_of as scale_of
from .options import (
    DEFAULTS as DEFAULTS, STARTS as STARTS, CommonOptions as CommonOptions, Options as Options,
    SolveOptions as SolveOptions, make_options as make_options,
)
from .starts import choose_starts as choose_starts, initial_point as initial_point
