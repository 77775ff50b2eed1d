from .all_designs import Every as Every, coverage_of as coverage_of, solve_all as solve_all
from .multistart import same_objective as same_objective
from .solve import solve as solve, solve_any_status as solve_any_status, evaluate_design as evaluate_design
from .workspace import Workspace as Workspace, workspace as workspace
