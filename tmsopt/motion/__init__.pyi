from .flow import sampled as sampled, shaken as shaken, stationary as stationary
from .measures import Measure as Measure
from .modes import ModeShape as ModeShape, mode_shapes as mode_shapes
from .simulate import Simulation as Simulation, simulate as simulate
from .system import System as System, system_of as system_of
