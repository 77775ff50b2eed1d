from .all_designs import Every as Every, estimate_coverage as estimate_coverage, solve_all as solve_all
from .policy import Policy as Policy, Rescue as Rescue
from .search import POLICY as POLICY
from .solve import evaluate_design as evaluate_design, solve as solve, solve_any_status as solve_any_status
from .state import (
    CheckedEnd as CheckedEnd,
    LocalEnd as LocalEnd,
    SearchState as SearchState,
    Start as Start,
    begin_search as begin_search,
    make_failed_end as make_failed_end,
    same_objective as same_objective,
)
from .tuning import TUNING as TUNING, Tuning as Tuning
