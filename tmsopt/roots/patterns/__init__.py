"""Which roots meet: patterns by name, the structure of given roots, the nearest polynomial that has one.

In: names such as EP4 or EP2+CEP2, and coefficients of polynomials. Out: factored forms to match, names and
multiplicities. Open `pattern` first: what a pattern is; then `structure`: which one a polynomial has.
"""

from tmsopt.roots.patterns.descriptions import STRUCTURES, in_words
from tmsopt.roots.patterns.enclosed import enclosed_roots, nearest_decimal, nearest_double, nearest_roots
from tmsopt.roots.patterns.naming import implies, shown_patterns

__all__ = [
    "STRUCTURES", "enclosed_roots", "implies", "in_words", "nearest_decimal", "nearest_double", "nearest_roots",
    "shown_patterns",
]  # fmt: skip
