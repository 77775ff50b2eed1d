from .crossings import crossings as crossings
from .growth import Growth as Growth, growth as growth
from .speeds import Speeds as Speeds, speed_of as speed_of, speeds as speeds, stable_speeds as stable_speeds
