"""How rows are carried out: in this process, in processes of this machine, on a Dask cluster.

Every engine takes the work and its units and yields finished rows as they come, in any order; the rows are the same
bits on all of them. They differ in what a crash costs: `in_process` ends with it, the others lose the unit being
solved, try it again alone, and quarantine a row that ends its worker twice.
"""

from tmsopt.studies.engines.dask import cluster
from tmsopt.studies.engines.dispatch import Assignments
from tmsopt.studies.engines.local import in_process, processes
from tmsopt.studies.engines.work import EngineError, Note, Unit, Work

__all__ = ["Assignments", "EngineError", "Note", "Unit", "Work", "cluster", "in_process", "processes"]
