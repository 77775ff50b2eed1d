"""Kirillov (2018): its reference bicycles, its laws beside a design, the data of its figures.

In: a design to compare, or the name of a figure. Out: a `Comparison`, or the curves of the figure. Open `compare`
first; `ledger` recomputes every claim.
"""

from tmsopt.paper.compare import Comparison, compare
from tmsopt.paper.experiment import experiment
from tmsopt.paper.ledger import verify
from tmsopt.paper.ledger.entry import Ledger
from tmsopt.paper.locus import locus, table_1_loci
from tmsopt.paper.reference import benchmark, experimental, optimised, table_1
from tmsopt.paper.sketch import sketch
from tmsopt.paper.universal import (
    ep_set,
    heavy_section,
    normalised,
    spire,
    spire_faces,
    stability_margin,
    table_1_paths,
    universal_path,
)

__all__ = [
    "Comparison", "Ledger", "benchmark", "compare", "ep_set", "experiment", "experimental", "heavy_section",
    "locus", "normalised", "optimised", "sketch", "spire", "spire_faces", "stability_margin", "table_1",
    "table_1_loci", "table_1_paths", "universal_path", "verify",
]  # fmt: skip
