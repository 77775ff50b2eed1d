"""Pareto: fronts of two or three objectives.

In: a problem with `pareto`. Out: a `Front` of designs, none of which dominates another. Open `pareto` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
