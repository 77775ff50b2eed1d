from . import laws as laws, models as models, plots as plots, roots as roots
from .proofs import certify as certify
from .charts import Chart as Chart, chart as chart, open_chart as open_chart
from .dynamics import Growth as Growth, Speeds as Speeds, growth as growth, speeds as speeds
from .explorer import Explorer as Explorer, explore as explore
from .problem import (
    Band as Band, Bound as Bound, Case as Case, NotSolved as NotSolved, Problem as Problem, Solution as Solution,
    Starts as Starts, load as load,
)
from .analysis import (
    Diagnosis as Diagnosis, Eigenvalues as Eigenvalues, diagnose as diagnose, eigenvalues as eigenvalues,
)
from .documents import save_report as save_report
from .errors import Fault as Fault, InputError as InputError
from .analysis import (
    Explanation as Explanation, Optimality as Optimality, explain as explain, optimality as optimality,
)
from .program import Options as Options
from .fronts import Front as Front, pareto as pareto
from .guide import Description as Description, convert as convert, describe as describe, schema as schema
from .boundaries import Nearest as Nearest, Robustness as Robustness, nearest as nearest, robustness as robustness
from .models import Bicycle as Bicycle, read_bicycle as read_bicycle, write_bicycle as write_bicycle
from .dynamics import Simulation as Simulation, simulate as simulate
from .paper import Comparison as Comparison, Ledger as Ledger, compare as compare, verify as verify
from .progress import Progress as Progress
from .proofs import Proof as Proof, prove as prove
from .search import (
    POLICY as POLICY, TUNING as TUNING, CheckedEnd as CheckedEnd, Every as Every, LocalEnd as LocalEnd,
    Policy as Policy, Rescue as Rescue, SearchState as SearchState, Start as Start, Tuning as Tuning, solve as solve,
    solve_all as solve_all,
)
from .spectra import (
    Cycle as Cycle, EnclosedPoint as EnclosedPoint, Loop as Loop, Sheets as Sheets, encircle as encircle,
    sheets as sheets,
)
from .studies import (
    Results as Results, Row as Row, Sampling as Sampling, Span as Span, Study as Study,
    latin_hypercube as latin_hypercube, load_study as load_study, monte_carlo as monte_carlo, over_grid as over_grid,
    run_study as run_study, sobol as sobol,
)
from .tracing import (
    Branch as Branch, BranchPoint as BranchPoint, Continuation as Continuation, Domain as Domain, Event as Event,
    EventPoint as EventPoint, Swallowtail as Swallowtail, Trace as Trace, continue_from as continue_from,
    domain as domain, swallowtail as swallowtail, trace as trace,
)

__version__: str
