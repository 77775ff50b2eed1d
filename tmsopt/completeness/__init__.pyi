from .complete import available as available, completeness as completeness
from .pruning import Puzzle as Puzzle, prune as prune
from .statement import Completeness as Completeness, Undecided as Undecided
from .trees import tree as tree
