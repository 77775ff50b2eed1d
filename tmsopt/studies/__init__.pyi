from .export import FORMATS as FORMATS, check_export as check_export, export as export
from .files import load_study as load_study, read_csv as read_csv
from .monte_carlo import Sampling as Sampling, monte_carlo as monte_carlo, prepare_study as prepare_study
from .rows import Row as Row, RowTable as RowTable, header as header, batch_rows as batch_rows
from .run import Results as Results, run_study as run_study, read_results as read_results
from .sampling import (
    Span as Span, grid as grid, latin_hypercube as latin_hypercube, sobol as sobol, sobol_note as sobol_note,
)
from .solving import Solver as Solver, solve_row as solve_row, split_into_blocks as split_into_blocks
from .store import (
    Store as Store, check_same_study as check_same_study, open_store as open_store, view_store as view_store,
)
from .study import Study as Study, definition as definition, over_grid as over_grid
from .summary import Share as Share, summarise as summarise, compute_yield as compute_yield
