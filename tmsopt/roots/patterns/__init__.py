"""Patterns of multiple roots by name, the structure of a polynomial, and the nearest polynomial with a structure.

In: names such as EP4 or EP2+CEP2, and coefficients of polynomials. Out: factored forms, names and multiplicities. Open
`pattern` first: it defines patterns; then `structure`: it finds the structure of a polynomial.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
