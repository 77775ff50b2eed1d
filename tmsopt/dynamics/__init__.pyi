from .crossings import crossings as crossings
from .growth import Growth as Growth, growth as growth
from .speeds import Speeds as Speeds, speed_of as speed_of, speeds as speeds, stable_speeds as stable_speeds
from .flow import sampled as sampled, shaken as shaken, stationary as stationary
from .measures import Measure as Measure
from .mode_shapes import ModeShape as ModeShape, mode_shapes as mode_shapes
from .simulate import Simulation as Simulation, simulate as simulate
from .system import System as System, system_of as system_of
