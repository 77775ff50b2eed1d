"""Explain an optimum: optimality, what each limit costs, what rounding does, warnings.

In: a solution. Out: an `Explanation` as data; `tmsopt.report` has its words. Open `explain` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
