"""Designs that were looked at, and the basins that they show.

In: points of the unit cube with what they are worth and violate. Out: the best of them, apart from each other, or one
for each basin. Open `looked` first.
"""

from tmsopt.search.basins.looked import REACHES, Looked, apart, basins, scattered

__all__ = ["REACHES", "Looked", "apart", "basins", "scattered"]
