"""Which roots meet: patterns by name, the structure of given roots, the nearest polynomial that has one.

In: names such as EP4 or EP2+CEP2, and coefficients of polynomials. Out: factored forms to match, names and
multiplicities. Open `pattern` first: what a pattern is; then `structure`: which one a polynomial has.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
