"""The document on the sensitivity of eigenvalues."""

import math

from tmsopt.analysis.sensitivity import Eigenvalues
from tmsopt.documents.blocks import Level, Parts, Row, Sentence, TableBlock, count_things
from tmsopt.documents.design_rows import format_root
from tmsopt.documents.tables import format_value
from tmsopt.problem import unit_of


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
    if near := eigenvalues.nearest_EP2:
        units = {n: unit_of(eigenvalues.problem.posed, n) for n in near.parameters}
        texts = (
            f"{n} = {u.show(near.parameters[n], 8)} (change {u.show(near.changes[n], 3)})" for n, u in units.items()
        )
        angle = f"the two eigenvectors are {math.degrees(near.angle):.3g}° apart"
        yield Sentence(f"{', '.join(texts)}; relative distance {near.distance:.3g}; {angle}", "nearest EP2 found")


def _format_sensitivity(x: float) -> str:
    return "infinite" if x == math.inf else format_value(x)
