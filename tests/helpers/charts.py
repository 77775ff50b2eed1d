"""Charts that tests of tiles and of folders share."""

import math

from tmsopt.charts import LAYERS, chart
from tmsopt.models import tms
from tmsopt.problem import Problem

FIXED = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
PLANE = Problem(
    model=tms,
    fixed=FIXED | {"chi_B": math.sqrt(2)},
    free={"Fr": (0.01, 5.0), "lambda_s": (-0.2, 1.4)},
    constraints={"trail": "nu_H >= 0.02", "rate": "abscissa <= 1", "law": "Fr == 2"},
    title="a plane",
)
SPACE = Problem(
    model=tms, fixed=FIXED, free={"Fr": (0.1, 5.0), "chi_B": (1.0, 2.0), "lambda_s": (0.1, 1.2)}, title="a space"
)
POINTS = (37, 23)
EXTRA = {"excess": "Fr - Fr_c", "settled": "abscissa * Fr", "T": "tan(lambda_s)", "one": "1", "second": "a2"}


def charted(path, problem=PLANE, **options):
    usual = {"points": POINTS, "layers": tuple(LAYERS), "quantities": EXTRA, "boundaries": False}
    return chart(problem, folder=path, **usual | options)


def files(path):
    """Everything but the record, whose lines carry times."""
    return {str(p.relative_to(path)): p.read_bytes() for p in sorted(path.rglob("*.npy"))}
