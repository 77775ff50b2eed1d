"""Environment variables that limit linear algebra libraries to one thread; matrices here are small."""

_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR", "NUMBA")

ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in _LIBRARIES} | {"VECLIB_MAXIMUM_THREADS": "1"}
"""Environment variables and their values; they must be set before such a library is loaded."""
