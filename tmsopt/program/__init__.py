"""A design problem as a smooth nonlinear program (NLP), and IPOPT on it.

Roots enter through polynomial factors, not through eigenvalues. `formulate` writes the NLP of a `Problem`; `nlp` holds
it as plain data; only `ipopt` calls IPOPT; `starts` chooses the starting points.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
