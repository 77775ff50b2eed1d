from .complete import available as available, completeness as completeness
from .statement import Completeness as Completeness, Undecided as Undecided
