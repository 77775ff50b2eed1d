"""Prove: the exceptional point exists, by interval Newton in ball arithmetic.

In: a solution. Out: a `Proof`: every number with its radius, or the reason why not. Open `prove` first, then
`existence`.
"""

from tmsopt.proofs.factored import Factored, abscissa_formula
from tmsopt.proofs.proof import Proof, prove_design
from tmsopt.proofs.prove import prove

__all__ = ["Factored", "Proof", "abscissa_formula", "prove", "prove_design"]
