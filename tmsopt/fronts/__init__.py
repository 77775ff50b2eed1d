"""Pareto fronts of two or three objectives.

Input: a problem with `pareto`. Result: a `Front` of designs, none of which dominates another. Read `pareto` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
