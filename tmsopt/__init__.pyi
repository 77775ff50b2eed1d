from . import laws as laws
from . import models as models
from . import plots as plots
from . import report as report
from . import roots as roots
from .certificates import certify as certify
from .charts import (
    Chart as Chart,
)
from .charts import (
    StoredChart as StoredChart,
)
from .charts import (
    chart as chart,
)
from .charts import (
    chart_to as chart_to,
)
from .charts import (
    open_chart as open_chart,
)
from .critical_speeds import Speeds as Speeds
from .critical_speeds import growth as growth
from .critical_speeds import speeds as speeds
from .design import (
    Band as Band,
)
from .design import (
    Bound as Bound,
)
from .design import (
    Case as Case,
)
from .design import (
    NotSolved as NotSolved,
)
from .design import (
    Problem as Problem,
)
from .design import (
    Solution as Solution,
)
from .design import (
    Starts as Starts,
)
from .design import (
    load as load,
)
from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .errors import Fault as Fault
from .errors import InputError as InputError
from .explanation import (
    Explanation as Explanation,
)
from .explanation import (
    Optimality as Optimality,
)
from .explanation import (
    explain as explain,
)
from .explanation import (
    optimality as optimality,
)
from .fronts import Front as Front
from .fronts import pareto as pareto
from .margins import Nearest as Nearest
from .margins import Robustness as Robustness
from .margins import nearest as nearest
from .margins import robustness as robustness
from .models import Bicycle as Bicycle
from .models import read_bicycle as read_bicycle
from .models import write_bicycle as write_bicycle
from .paper import Comparison as Comparison
from .paper import Ledger as Ledger
from .paper import compare as compare
from .paper import verify as verify
from .proofs import Proof as Proof
from .proofs import prove as prove
from .solver import Every as Every
from .solver import solve as solve
from .solver import solve_all as solve_all
from .studies import (
    Results as Results,
)
from .studies import (
    Row as Row,
)
from .studies import (
    Study as Study,
)
from .studies import (
    latin_hypercube as latin_hypercube,
)
from .studies import (
    load_study as load_study,
)
from .studies import (
    monte_carlo as monte_carlo,
)
from .studies import (
    over_grid as over_grid,
)
from .studies import (
    run_study as run_study,
)
from .studies import (
    sobol as sobol,
)
from .tracing import (
    Branch as Branch,
)
from .tracing import (
    Domain as Domain,
)
from .tracing import (
    Event as Event,
)
from .tracing import (
    Swallowtail as Swallowtail,
)
from .tracing import (
    Trace as Trace,
)
from .tracing import (
    domain as domain,
)
from .tracing import (
    swallowtail as swallowtail,
)
from .tracing import (
    trace as trace,
)

__version__: str
