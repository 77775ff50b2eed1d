"""Units: numbers from text such as "40 cm", the unit of an expression, decay times and frequencies of roots.

In: texts, numbers, parameter sets. Out: numbers in the parameters' own units, and names of units. Open `text` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
