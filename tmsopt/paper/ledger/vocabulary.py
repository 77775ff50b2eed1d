"""Words of the expressions of `claims.toml`, besides its definitions: all of `algebra`, and the words below."""

from collections.abc import Mapping
from inspect import getmembers, isfunction
from typing import Any

import flint

from tmsopt import laws
from tmsopt.algebra.balls import Tilt
from tmsopt.models import copo, matrices, tms
from tmsopt.paper.ledger import algebra
from tmsopt.paper.ledger.entry import judge_decimal
from tmsopt.paper.ledger.sample import describe_design, draw_sample
from tmsopt.roots.polynomial import evaluate, product, quadratic_pencil, shift

_FUNCTIONS = (
    *(abs, all, any, dict, int, len, list, max, min, range, sum),
    *(copo, matrices, quadratic_pencil, Tilt, product, shift, evaluate, describe_design, draw_sample),
)

VOCABULARY: Mapping[str, Any] = {
    **dict(getmembers(algebra, isfunction)),
    **{function.__name__: function for function in _FUNCTIONS},
    "laws": vars(laws),  # as the paper prints them; laws.NAME
    "SI_PARAMETERS": [name for name in tms.sets[1].names if name != "g"],
    "verdict_on": lambda printed, value: judge_decimal(printed, value).verdict,
    "ball": flint.arb,
    "complex_ball": flint.acb,
    "pi": flint.arb.pi,
    "tan": lambda x: flint.arb(x).tan(),
    "atan": lambda x: flint.arb(x).atan(),
    "overlap": lambda x, y: flint.arb(x).overlaps(flint.arb(y)),
    "real": lambda z: z.real,
    "imaginary": lambda z: z.imag,
    "middle": lambda x: float(x.mid()),
    "rank": lambda rows: flint.fmpz_mat(rows).rank(),
}
