from .front import Front as Front
from .pareto import pareto as pareto
