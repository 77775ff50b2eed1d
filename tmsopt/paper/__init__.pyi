from .compare import Comparison as Comparison, compare as compare
from .experiment import experiment as experiment
from .ledger import verify as verify
from .ledger.entry import Ledger as Ledger
from .locus import multiple_roots as multiple_roots, table_1_loci as table_1_loci
from .reference import (
    benchmark as benchmark, experimental as experimental, optimised_benchmark as optimised_benchmark,
    table_1 as table_1,
)
from .sketch import sketch as sketch
from .universal import (
    ep_set as ep_set, heavy_section as heavy_section, normalise_quartics as normalise_quartics, spire as spire,
    spire_faces as spire_faces, table_1_paths as table_1_paths,
)
