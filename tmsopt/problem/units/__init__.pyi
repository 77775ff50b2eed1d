from .dimensions import Dimension as Dimension, dimension as dimension
from .readings import (
    Reading as Reading, decay_time as decay_time, frequencies as frequencies, growth_time as growth_time,
    reading as reading, readings as readings,
)
from .tables import TABLES as TABLES, numbers as numbers
from .text import (
    USUAL as USUAL, by_pint as by_pint, factor as factor, read as read, with_unit as with_unit,
)
