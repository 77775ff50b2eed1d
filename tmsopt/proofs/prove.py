"""The existence of what a problem asks for, proved: solve first, then prove."""

from collections.abc import Mapping
from typing import Any, Unpack

from tmsopt.design.files import Given
from tmsopt.design.solution import Solution
from tmsopt.design.verdict.stability import crossing_in_words
from tmsopt.errors import Fault, InputError
from tmsopt.formulation.options import AskedOfSolve, options_of, taking
from tmsopt.progress import begin
from tmsopt.proofs.proof import DIGITS, Proof, prove_design
from tmsopt.solver.solve import solved


@taking(AskedOfSolve)
def prove(
    design: Given, digits: int = DIGITS, *, exact: Mapping[str, Any] | None = None, **options: Unpack[AskedOfSolve]
) -> Proof:
    """Prove that the design a problem asks for exists, in ball arithmetic, with what follows for its stability.

    An interval Newton test (Krawczyk) on a_k = a0 c_k with the problem's equalities proves that exactly one solution
    lies within a stated radius, and that it is the one the stored numbers stand for. What cannot be proved is refused
    in `Proof.reason`, never guessed.

    Args:
        design: a solution; or a problem or its file, solved first.
        digits: that every number is given to.
        exact: parameter, or ``tan(lambda_s)`` → the number that it is exactly: an int, a Fraction, a ``flint.fmpq``,
            text such as ``"-2/5"`` or ``"20 deg"``. Other numbers stand for the shortest decimals that print them.
        options: of `solve`, e.g. ``starts``; of a solution ``progress`` alone.

    Raises:
        InputError: for a problem that asks nothing, options beside a solution, digits out of range, or exact numbers
            that are not the design's.

    Example:
        >>> tmsopt.prove("problems/ep4.toml", digits=40).parameters["chi_B"].value[:42]  # the square root of 2
        '1.4142135623730950488016887242096980785696'

    More: docs/explanation/proofs.md
    """
    wrong = [name for name in options if name != "progress"]
    if isinstance(design, Solution) and wrong:
        message = f"found {', '.join(wrong)}; options are for solving, and this is solved: give the problem instead"
        raise InputError([Fault(message, ("options",))])
    how = options_of(options, AskedOfSolve)
    found = solved(design, how)
    problem = found.problem
    if found.status != "optimal":
        crossings = [crossing_in_words(m) for m in found.meetings if not m.exceptional]
        reason = f"the problem is not solved ({found.status}): there is no design to prove"
        if problem.pattern and crossings:
            reason = f"none found: where roots meet is {crossings[0]}"
        claim = f"a design of '{problem.title or 'the problem'}' exists"
        return Proof(claim, False, reason, digits=digits, problem=problem)
    begin(how.progress, f"proving to {digits} digits")
    shown = found.of_polynomial
    return prove_design(problem, found.parameters, shown.name, digits, exact, found.worst, shown.roots)
