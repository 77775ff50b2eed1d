"""Eigenvalues over a plane of two parameters: loops around exceptional points, and Riemann sheets.

In: a problem whose model has matrices. Out: a `Loop`, along which eigenvalues exchange, or `Sheets`, their values on a
grid. Open `loop` first; `plane` evaluates the matrices, and `path` follows eigenvalues.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
