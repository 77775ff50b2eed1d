from .export import (
    FORMATS as FORMATS, check_export as check_export, columns as columns, export as export, header as header,
)
from .load import load_study as load_study
from .monte_carlo import (
    Sampling as Sampling, check_unchanged as check_unchanged, monte_carlo as monte_carlo, planned as planned,
)
from .neighbours import blocks as blocks
from .row import Row as Row
from .run import Results as Results, fill as fill, run_study as run_study, stored as stored
from .samples import (
    Span as Span, grid as grid, latin_hypercube as latin_hypercube, sobol as sobol, sobol_note as sobol_note,
)
from .solving import Solver as Solver, alone as alone
from .study import Study as Study, definition as definition, over_grid as over_grid
from .summary import Share as Share, summary as summary, wilson as wilson, yield_of as yield_of
from .vary import read_csv as read_csv
