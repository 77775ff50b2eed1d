"""One formula for floats, arrays, CasADi expressions, fractions and balls (intervals with a midpoint and a radius).

In: formulas written once as plain arithmetic, and numbers of any of these kinds. Out: values of the same kind,
enclosures, and solutions that Krawczyk's interval Newton method proves. Open `kinds` first: it lists the operations of
each kind of number.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
