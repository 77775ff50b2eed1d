"""Real polynomials and their roots: factored forms, stability, numeric and exact roots, multiplicity.

In: coefficients, highest power first. Out: roots, stability, counts of real roots, and structures. Open `polynomial`
first. `patterns` finds out which roots coincide, and `quartics` solves millions of quartics at once.
"""

from tmsopt.roots.batch import classify, find_motion
from tmsopt.roots.chains import make_cluster, schur_form
from tmsopt.roots.conditioning import Conditioning, condition_eigenvalue, find_conditioning
from tmsopt.roots.count import real_roots
from tmsopt.roots.exact import exact_abscissa, exact_roots
from tmsopt.roots.jordan import exact_longest, exact_nullity, has_one_eigenvector, is_regular, jordan
from tmsopt.roots.numeric import abscissa, backward_error, rebuilt, roots
from tmsopt.roots.patterns.composed import PATTERNS, composition, pattern
from tmsopt.roots.patterns.pattern import Pattern
from tmsopt.roots.patterns.structure import Structure, multiple_real_roots, pattern_distance, structure
from tmsopt.roots.polynomial import Root, determinant, evaluate, product, quadratic_pencil, shift
from tmsopt.roots.quartics.classes import CLASSES, Classes, quartic_classes, quartic_is_stable
from tmsopt.roots.quartics.quartic import Factors, Motion, abscissa_and_damping, quartic_factors
from tmsopt.roots.spectrum import spectrum
from tmsopt.roots.stability import discriminant, hurwitz_minors, is_stable, lienard_chipart, routh

__all__ = [
    "CLASSES",
    "PATTERNS",
    "Classes",
    "Conditioning",
    "Factors",
    "Motion",
    "Pattern",
    "Root",
    "Structure",
    "abscissa",
    "abscissa_and_damping",
    "backward_error",
    "classify",
    "composition",
    "condition_eigenvalue",
    "determinant",
    "discriminant",
    "evaluate",
    "exact_abscissa",
    "exact_longest",
    "exact_nullity",
    "exact_roots",
    "find_conditioning",
    "find_motion",
    "has_one_eigenvector",
    "hurwitz_minors",
    "is_regular",
    "is_stable",
    "jordan",
    "lienard_chipart",
    "make_cluster",
    "multiple_real_roots",
    "pattern",
    "pattern_distance",
    "product",
    "quadratic_pencil",
    "quartic_classes",
    "quartic_factors",
    "quartic_is_stable",
    "real_roots",
    "rebuilt",
    "roots",
    "routh",
    "schur_form",
    "shift",
    "spectrum",
    "structure",
]
