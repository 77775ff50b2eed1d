"""Make the net: ``python -m benchmarks.suites.equivalence CHECKOUT``, with ``tmsopt`` as it is in that checkout.

Three runs, whose differences are the conditions of the answers: as it is, with another processor's arithmetic, and from
another seed.
"""

import sys
from pathlib import Path

from benchmarks.suites.equivalence import CASES, answer_all, write_net

OTHER = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
"""Variables that choose another arithmetic."""


def main(checkout: Path) -> None:
    """Three runs of every case, kept after each."""
    runs = []
    for seed, environment in ((0, {}), (0, OTHER), (1, {})):
        runs.append(answer_all(CASES, checkout, seed, environment=environment, listener=_say))
        write_net(runs)


def _say(done: int, most: int) -> None:
    if done % 50 == 0 or done == most:
        print(f"{done} of {most} processes", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
