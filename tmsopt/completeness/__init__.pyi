from .complete import (
    Completeness as Completeness, Undecided as Undecided, available as available, completeness as completeness,
)
from .pruning import Puzzle as Puzzle, prune as prune, tree as tree
