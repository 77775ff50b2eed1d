"""That no design of a box was missed: interval branch and prune (codac) over designs with a root pattern.

In: a problem that leaves no freedom. Out: every design with its proof, boxes and time, or what stayed undecided and
where, as `Completeness`. Open `complete` first, then `conditions`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
