"""The document on the sensitivity of eigenvalues."""

import math

from tmsopt.analysis.sensitivity import Eigenvalues
from tmsopt.documents.blocks import Level, Parts, Row, TableBlock, count_things
from tmsopt.documents.design_rows import format_root
from tmsopt.documents.tables import format_value


def write_eigenvalues(eigenvalues: Eigenvalues, _level: Level = "full") -> Parts:
    """Write a table of the eigenvalues with their sensitivities; a conjugate pair is one row."""
    entries = [s for s in eigenvalues.entries if s.im >= 0 or s.eigenfrequency is not None]
    largest = max((s.petermann for s in entries), default=math.nan)
    yield count_things(eigenvalues.entries, "eigenvalue"), f"largest Petermann factor {_format_sensitivity(largest)}"
    noun = "eigenfrequency" if eigenvalues.problem.model.is_complex else "root"
    rows: list[Row] = [(noun, "phase rigidity", "Petermann factor", "condition number")]
    for s in entries:
        numbers = (_format_sensitivity(x) for x in (s.phase_rigidity, s.petermann, s.condition))
        rows.append((format_root(s, 5, s.multiplicity), *numbers))
    yield TableBlock(rows, "Sensitivity of the eigenvalues")


def _format_sensitivity(x: float) -> str:
    return "infinite" if x == math.inf else format_value(x)
