from .crossings import find_crossings as find_crossings
from .growth import Growth as Growth, growth as growth
from .speeds import Speeds as Speeds, speed_of as speed_of, speeds as speeds, stable_speeds as stable_speeds
from .flow import simulate_noise as simulate_noise, stationary_covariance as stationary_covariance
from .measures import Measure as Measure
from .mode_shapes import ModeShape as ModeShape
from .simulate import Simulation as Simulation, simulate as simulate
from .system import System as System, system_of as system_of
