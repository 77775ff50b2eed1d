from .axis import edges_at as edges_at, is_exactly_multiple as is_exactly_multiple, stands_on as stands_on
from .boundaries import edges as edges, heavily_damped as heavily_damped
from .nearest import (
    Nearest as Nearest, Robustness as Robustness, nearest as nearest, robustness as robustness,
    robustness_at as robustness_at,
)
