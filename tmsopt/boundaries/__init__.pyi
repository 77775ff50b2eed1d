from .axis import edges_at as edges_at, find_edges as find_edges, is_exactly_multiple as is_exactly_multiple
from .boundaries import is_heavily_damped as is_heavily_damped, list_edges as list_edges
from .nearest import (
    Nearest as Nearest, Robustness as Robustness, find_stability_margins as find_stability_margins, nearest as nearest,
    robustness as robustness,
)
