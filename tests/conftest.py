"""What makes the whole suite cheaper and changes no test."""

import gc
import os

# Before NumPy is loaded. Each of the two or more workers has a core: helpers of the linear algebra only take it away
# from another one, and spin while they wait.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def pytest_collection_finish() -> None:
    """Collected tests and loaded modules stay until the end: no collection of garbage need look at them again."""
    gc.collect()
    gc.freeze()
