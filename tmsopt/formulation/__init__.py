"""A design problem as a smooth nonlinear program by factors, and IPOPT on it.

In: a `Problem`. Out: an `NLP` with functions, bounds and units, starting points, runs of IPOPT, and points polished
by Newton. Open `formulate` first: the three forms; `builder` puts them together, `ipopt` alone calls the solver.
"""

from tmsopt.formulation.formulate import abscissa, formulate, matching
from tmsopt.formulation.nlp import NLP, Factor, Scale, objective_size, scale_of
from tmsopt.formulation.options import DEFAULTS, STARTS, Asked, AskedOfSolve, Options, options_of
from tmsopt.formulation.starts import complete, designs, opposite, worth

__all__ = [
    "DEFAULTS", "NLP", "STARTS", "Asked", "AskedOfSolve", "Factor", "Options", "Scale", "abscissa", "complete",
    "designs", "formulate", "matching", "objective_size", "opposite", "options_of", "scale_of", "worth",
]  # fmt: skip
