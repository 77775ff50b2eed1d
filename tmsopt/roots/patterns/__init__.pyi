from .descriptions import STRUCTURES as STRUCTURES, describe_structure as describe_structure
from .root_enclosures import (
    enclosed_roots as enclosed_roots, nearest_decimal as nearest_decimal, nearest_double as nearest_double,
    nearest_roots as nearest_roots,
)
from .naming import find_patterns as find_patterns, has_pattern as has_pattern
