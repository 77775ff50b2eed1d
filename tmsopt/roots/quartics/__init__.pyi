from .degenerate import hard_factors as hard_factors
from .factors import cube_root as cube_root, largest_root as largest_root
