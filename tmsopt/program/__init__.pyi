from .ipopt import forget as forget
from .formulate import abscissa as abscissa, formulate as formulate, matching as matching
from .nlp import NLP as NLP, Factor as Factor, Scale as Scale, objective_size as objective_size, scale_of as scale_of
from .options import (
    DEFAULTS as DEFAULTS, STARTS as STARTS, Asked as Asked, AskedOfSolve as AskedOfSolve, Options as Options,
    options_of as options_of,
)
from .starts import (
    designs as designs, initial_point as initial_point,
)
