from .all_designs import Every as Every, coverage_of as coverage_of, solve_all as solve_all
from .multistart import same as same
from .solve import solve as solve, solved as solved, standing as standing
from .workspace import Family as Family, Workspace as Workspace, workspace as workspace
