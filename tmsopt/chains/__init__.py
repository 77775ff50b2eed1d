"""Systems by their matrices: Jordan chains, and the designs at which eigenvalues coincide.

In: a problem whose model has matrices. Out: designs with a multiple eigenvalue that has one eigenvector, and the number
of eigenvectors of multiple roots. Open `points` first; `family` evaluates the matrices.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
