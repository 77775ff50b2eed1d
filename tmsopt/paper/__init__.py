"""Kirillov (2018): its reference bicycles, its laws compared with a design, and the data of its figures.

In: a design to compare, or the name of a figure. Out: a `Comparison`, or the curves of the figure. Read `compare`
first; `ledger` recomputes every claim.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
