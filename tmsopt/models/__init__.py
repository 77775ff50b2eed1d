"""Models whose roots can be designed."""

from tmsopt.models.model import Model, Parameter, ParameterSet, Quantity, Range, Values
from tmsopt.models.tms import tms

MODELS = {tms.name: tms}
"""Models that a problem file can name."""

__all__ = ["MODELS", "Model", "Parameter", "ParameterSet", "Quantity", "Range", "Values", "tms"]
