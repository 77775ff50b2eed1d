from .dimensions import Dimension as Dimension
from .readings import (
    Reading as Reading, decay_time as decay_time, frequencies as frequencies, growth_time as growth_time,
    reading as reading, readings as readings,
)
from .tables import TABLES as TABLES, numbers as numbers
from .text import factor as factor, read as read, with_unit as with_unit
