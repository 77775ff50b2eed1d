from .descriptions import STRUCTURES as STRUCTURES, in_words as in_words
from .enclosed import (
    enclosed_roots as enclosed_roots, nearest_decimal as nearest_decimal, nearest_double as nearest_double,
    nearest_roots as nearest_roots,
)
from .naming import implies as implies, shown_patterns as shown_patterns
