"""Study: one problem solved for thousands of rows of what varies in it.

In: a study file, or `Study`. Out: `Results`, kept row by row in a store that survives any kill. Open `study` first,
then `run`; `engines` carries rows out, `store` keeps them.
"""

from tmsopt.studies.export import FORMATS, check_export, columns, export
from tmsopt.studies.load import load_study
from tmsopt.studies.monte_carlo import Sampling, monte_carlo, planned
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.row import Row
from tmsopt.studies.run import Results, fill, run_study
from tmsopt.studies.samples import Span, grid, latin_hypercube, sobol, sobol_note
from tmsopt.studies.solving import Solver, alone
from tmsopt.studies.study import Study, definition, over_grid
from tmsopt.studies.summary import Share, summary, wilson, yield_of
from tmsopt.studies.vary import read_csv

__all__ = [
    "FORMATS", "Results", "Row", "Sampling", "Share", "Solver", "Span", "Study", "alone", "blocks", "check_export",
    "columns", "definition", "export", "fill", "grid", "latin_hypercube", "load_study", "monte_carlo", "over_grid",
    "planned", "read_csv", "run_study", "sobol", "sobol_note", "summary", "wilson", "yield_of",
]  # fmt: skip
