from .dimensions import Dimension as Dimension, dimension as dimension
from .readings import (
    Reading as Reading, decay_time as decay_time, frequencies as frequencies,
    convert_exactly as convert_exactly, readings as readings,
)
from .tables import TABLES as TABLES, read_numbers as read_numbers
from .text import (
    COMMON_UNITS as COMMON_UNITS, parse_exact_quantity as parse_exact_quantity, parse_quantity as parse_quantity,
    pint_factor as pint_factor, unit_factor as unit_factor,
)
