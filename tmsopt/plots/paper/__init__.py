"""The figures of Kirillov (2018), drawn from recomputed data.

In: the data of `tmsopt.paper`. Out: figures. Read `gallery` first: it has the list of the figures.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
