"""How far a design is from weave, capsize, infinity and heavy damping: the robustness radius.

In: a design with weights on its parameters. Out: the nearest point of each boundary, and the radius. Open `nearest`
first.
"""

from tmsopt.margins.boundaries import edges, heavily_damped
from tmsopt.margins.nearest import Nearest, Robustness, nearest, robustness

__all__ = ["Nearest", "Robustness", "edges", "heavily_damped", "nearest", "robustness"]
