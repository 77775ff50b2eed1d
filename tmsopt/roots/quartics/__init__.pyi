from .degenerate import hard_factors as hard_factors
from .factors import largest_root as largest_root
