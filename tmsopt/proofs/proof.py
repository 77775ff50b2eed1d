"""The existence of what a problem asks for, proved: solve first, then prove."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

import flint

from tmsopt.algebra.balls import Number, ProvedRoot, fraction, number
from tmsopt.algebra.krawczyk import ProofFailed
from tmsopt.errors import Fault, InputError, count_faults
from tmsopt.models.exact import ExactDesign, as_exact_design
from tmsopt.models.names import number_text
from tmsopt.models.user_spectrum import pattern_of, user_roots, user_structure_name
from tmsopt.problem.cases import Case
from tmsopt.problem.files import Given
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import units_of
from tmsopt.problem.verdict.stability import CROSSING, describe_crossing
from tmsopt.program.options import SolveOptions, documents_options, make_options
from tmsopt.progress import begin
from tmsopt.proofs.existence import Existing, as_stored, beside, exactly
from tmsopt.proofs.factored import multiple_roots
from tmsopt.proofs.facts import NOTHING, Verdict, eigenvectors, heavy_damping, inside, limits, stability
from tmsopt.records import Printable, Table, plain
from tmsopt.roots import PATTERNS, Pattern, Root
from tmsopt.roots.patterns.complex_patterns import as_complex_pattern
from tmsopt.roots.patterns.naming import find_patterns, has_pattern
from tmsopt.search.solve import solve_any_status

DIGITS = 30
"""Digits by default."""

MOST = 1000
"""Digits at most."""

_QUARTIC = 4  # degree of the patterns that a name alone tells
_EXTRA = 50  # decimal digits carried beyond twice those asked for, where a design is taken as it is

_SIMPLE = {
    "pair": "the rightmost roots are a simple complex pair",
    "real": "the rightmost root is real and simple",
    "single": "the least damped eigenfrequency is simple",
}


@dataclass(frozen=True, repr=False)
class Proof(Printable):
    """What is proved about a design in ball arithmetic; plain data, decimals as text.

    Attributes:
        claim: what was to be proved.
        proved: whether it is.
        reason: if not, what failed and what to do.
        pattern: the root pattern, ``pair`` or ``real``.
        method: ``Krawczyk``, ``exact factorisation``, ``isolated roots`` or ``none``.
        digits: asked for.
        stored: whether all numbers below are of the design as stored, since nothing else is proved.
        parameters: every parameter of the proved design (rad, SI units).
        tangents: of its angles, in which the equations are solved.
        unknowns: factor coefficients of the pattern, and quantities with an equation of their own.
        moved: parameters that were solved for; the others are held.
        held: parameter, or ``tan(parameter)`` → the fraction that it is taken for, exactly.
        stated: of these, those given exactly by the user.
        numbers: those in formulas that are not whole, as written; each is what its digits say.
        radius: of the largest ball among the numbers solved for.
        uniqueness: no other solution is this near, in each of these numbers; inf where none is solved for.
        distance: from the proved to the stored design, in the parameter for which it is largest against `explained`.
        explained: how far rounding of the stored numbers may move that parameter.
        roots: with exact multiplicities, rightmost first; none where two cannot be told apart.
        eigenfrequencies: of a complex system ω = i s, in the order of the roots.
        abscissa: the largest real part.
        geometric_multiplicity: most independent eigenvectors of a multiple root; None where nothing tells.
        defective: whether every multiple root has fewer eigenvectors than its multiplicity; an exceptional point has 1.
        stable: whether all roots are left of the imaginary axis.
        heavily_damped: whether all roots are real and negative.
        inside: whether the proved design is in the problem's box.
        limits: inequality of the problem → ``met``, ``violated``, ``binds`` or ``cannot be told``, at this design.
        seconds: that the proof took.
        problem: whose design it is.

    Example:
        >>> proof = tmsopt.prove("problems/ep4.toml")
        >>> proof.proved, proof.pattern, proof.parameters["chi_B"].value[:20]  # the square root of 2
        (True, 'EP4', '1.414213562373095048')

    More: docs/explanation/proofs.md
    """

    claim: str
    proved: bool
    reason: str = ""
    pattern: str = ""
    method: str = "none"
    digits: int = DIGITS
    stored: bool = False
    parameters: Table[Number] = Table()
    tangents: Table[Number] = Table()
    unknowns: Table[Number] = Table()
    moved: tuple[str, ...] = ()
    held: Table[str] = Table()
    stated: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    radius: float = math.nan
    uniqueness: float = math.nan
    distance: float = math.nan
    explained: float = math.nan
    roots: tuple[ProvedRoot, ...] = ()
    eigenfrequencies: tuple[ProvedRoot, ...] = ()
    abscissa: Number | None = None
    geometric_multiplicity: int | None = None
    defective: Verdict = NOTHING
    stable: Verdict = NOTHING
    heavily_damped: Verdict = NOTHING
    inside: Verdict = NOTHING
    limits: Table[str] = Table()
    seconds: float = 0.0
    problem: Problem | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: decimals as text, summaries as numbers, None for what does not exist."""
        return {
            **plain(self, "claim proved reason pattern method digits"),
            "of": "the design as stored" if self.stored or not self.proved else "the proved design",
            **plain(self, "parameters tangents unknowns moved held stated numbers"),
            "units": units_of(self.problem.posed) if self.problem else {},
            **plain(self, "radius uniqueness distance explained roots"),
            **(plain(self, "eigenfrequencies") if self.eigenfrequencies else {}),
            **plain(self, "abscissa geometric_multiplicity defective stable heavily_damped inside limits"),
            "seconds": round(self.seconds, 4),
        }


@documents_options(SolveOptions)
def prove(
    design: Given, digits: int = DIGITS, *, exact: Mapping[str, Any] | None = None, **options: Unpack[SolveOptions]
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
    how = make_options(options, SolveOptions)
    found = solve_any_status(design, how)
    problem = found.problem.posed
    if found.status != "optimal":
        crossings = [describe_crossing(m) for m in found.meetings if not m.exceptional]
        reason = f"the problem is not solved ({found.status}): there is no design to prove"
        if problem.pattern and crossings:
            reason = f"none found: where roots meet is {crossings[0]}"
        claim = f"a design of '{problem.title or 'the problem'}' exists"
        return Proof(claim, False, reason, digits=digits, problem=problem.problem)
    begin(how.progress, f"proving to {digits} digits")
    shown = found.of_polynomial
    return prove_design(problem, found.parameters, shown.name, digits, exact, found.worst, shown.roots)


def prove_design(
    problem: Posed,
    parameters: Mapping[str, float],
    structure: str,
    digits: int = DIGITS,
    exact: Mapping[str, Any] | None = None,
    case: Case | None = None,
    roots: Sequence[Root] = (),
) -> Proof:
    """Prove that the pattern which a problem locates, or which a design's roots show, exists; and what follows.

    Args:
        parameters: the design, near which the pattern is looked for.
        structure: name of a pattern, ``pair`` or ``real``: the structure of the design's rightmost roots.
        digits: that every number is given to.
        exact: parameter, or ``tan(parameter)`` → the exact number that it stands for; such a parameter is held. All
            other numbers stand for the shortest decimals that print them.
        case: of scenarios and tolerances, the one to which the structure belongs.
        roots: of the design with multiplicities; other than for quartics, they tell the structure in full.

    Raises:
        InputError: for digits out of range, or exact numbers that are not the design's.
    """
    if faults := count_faults("digits", digits, 1, MOST):
        raise InputError(faults)
    digits = int(digits)
    began = time.perf_counter()
    varied = case.applied(parameters) if case else dict(parameters)
    typed = {n: text for n, text in problem.typed(varied).items() if n in problem.fixed}
    design = as_exact_design(problem.parameter_set, varied, exact, typed)
    with flint.ctx.workdps(2 * digits + _EXTRA):
        patterns = _patterns(problem, structure, roots)
        # Of one case alone: its constraints are those of the nominal design, or of every case.
        asked = problem.nominal.derive(constraints={}) if case and (case.at or case.offset) else problem
        proof = _proved(asked, design, varied, structure, patterns, digits)
        return replace(proof, problem=problem.problem, seconds=time.perf_counter() - began)


def _proved(
    problem: Posed,
    design: ExactDesign,
    varied: Mapping[str, float],
    structure: str,
    patterns: Sequence[Pattern],
    digits: int,
) -> Proof:
    """The first proof that succeeds, or why none does with what holds for the design as stored."""
    reasons: list[str] = []
    for pattern in patterns or ([] if structure in _SIMPLE else _decided(problem, design)):
        if exact := exactly(problem, pattern, design):
            return _assembled(problem, design, pattern.name, pattern, exact, digits)
    for pattern in patterns:
        try:
            found = beside(problem, pattern, design, varied, digits)
        except ProofFailed as refusal:
            reasons.append(str(refusal))
        else:
            return _assembled(problem, design, pattern.name, pattern, found, digits)
    name = problem.locate or user_structure_name(problem.model, structure)
    meant = next((p for p in patterns if p.name == name), None)
    stored = as_stored(problem, design)
    if stored is None:
        reason = reasons[0] if reasons else "a0 cannot be told from 0: a root may be at infinity"
        return Proof(_claim(name, meant), False, reason, name, digits=digits)
    why = reasons or _of_simple(problem, structure, stored)
    return _assembled(problem, design, name, meant, stored, digits, why, stored=True)


def _patterns(problem: Posed, structure: str, roots: Sequence[Root]) -> list[Pattern]:
    """Patterns to prove: that of the structure, if it has the one that is located, and then the latter."""
    located = problem.pattern
    quartic = PATTERNS if problem.model.degree == _QUARTIC else {}
    shown = find_patterns(roots) if roots else [quartic[structure]] if structure in quartic else []
    if located and not (has_pattern(roots, located.form) if roots else located.form == structure):
        shown = []
    named = [quartic.get(p.name, p) for p in shown]
    if problem.model.carrier is not None:
        named = [as_complex_pattern(p) for p in named]
    return list({p.name: p for p in [*named, *([located] if located else [])]}.values())


def _decided(problem: Posed, design: ExactDesign) -> list[Pattern]:
    """The pattern of all multiple roots of a design that is exact."""
    a = design.coefficients(problem.model, problem.parameter_set)
    name = multiple_roots(a) if a else ""
    return [pattern_of(problem.model, user_structure_name(problem.model, name))] if name else []


def _of_simple(problem: Posed, structure: str, found: Existing) -> list[str]:
    """Why the structure of a design without multiple roots is not proved; nothing if it is."""
    name = user_structure_name(problem.model, structure)
    if structure not in _SIMPLE:
        return [f"the structure is {name}: double precision cannot tell it; locate the pattern that is meant"]
    roots = found.factored.roots
    if roots is None:
        return ["the roots cannot be isolated: some are equal, or too near; locate the pattern that is meant"]
    rest = roots[1:] if roots[0].real else roots[2:]
    if roots[0].real == (structure == "real") and all(z.re < roots[0].re for z in rest):
        return []
    return [f"the rightmost root of the design as stored is not certainly a {name}"]


def _assembled(
    problem: Posed,
    design: ExactDesign,
    name: str,
    pattern: Pattern | None,
    found: Existing,
    digits: int,
    reasons: Sequence[str] = (),
    stored: bool = False,
) -> Proof:
    numbers = {
        n: number(ball, digits)
        if n in (*found.moved, *design.tangents) or (known := design.values[n].fraction) is None
        else fraction(known, digits)
        for n, ball in found.parameters.items()
    }
    abscissa = found.factored.abscissa
    real = problem.model.carrier is None
    hidden = () if real or pattern is None else pattern.unknowns  # of the double with its carrier
    hidden = (*hidden, *(f"{pattern.name}.{n}" for n in hidden)) if pattern else ()
    roots = user_roots(problem.model, found.factored.roots or ())
    geometric, defective = eigenvectors(problem, design, found)
    if not reasons and geometric is not None and geometric > 1 and "EP" in name:
        reasons = [f"{'not an EP' if defective.holds else CROSSING}: {defective.words}"]
    return Proof(
        claim=_claim(name, pattern),
        proved=not reasons,
        reason=reasons[0] if reasons else "",
        pattern=name,
        method=found.method,
        digits=digits,
        stored=stored,
        parameters=Table({n: numbers[n] for n in problem.parameter_set.names}),
        tangents=Table({n: number(ball, digits) for n, ball in found.tangents.items()}),
        unknowns=Table({n: number(ball, digits) for n, ball in found.unknowns.items() if n not in hidden}),
        moved=found.moved,
        held=Table(dict(design.text(n) for n in problem.parameter_set.names if n not in found.moved)),
        stated=design.stated,
        numbers=_numbers(problem),
        radius=found.radius,
        uniqueness=found.uniqueness,
        distance=found.distance,
        explained=found.explained,
        roots=tuple(ProvedRoot(number(z.re, digits), number(z.im, digits), z.multiplicity) for z in roots),
        eigenfrequencies=tuple(
            ProvedRoot(number(-z.im, digits), number(z.re, digits), z.multiplicity) for z in (() if real else roots)
        ),
        abscissa=None if abscissa is None else number(abscissa, digits),
        geometric_multiplicity=geometric,
        defective=defective,
        stable=stability(found.factored, not real),
        heavily_damped=heavy_damping(found.factored) if real else NOTHING,
        inside=inside(problem, design, found),
        limits=Table(limits(problem, found)),
    )


def _numbers(problem: Posed) -> tuple[str, ...]:
    """Texts of the numbers in formulas that are not whole."""
    constants = [x for c in problem.conditions.values() if c.equality for x in c.formula.constants]
    equalities = [text for x in constants if not (text := number_text(x)).lstrip("-").isdigit()]
    return tuple(dict.fromkeys([*problem.model.numbers, *equalities]))


def _claim(name: str, pattern: Pattern | None) -> str:
    if pattern is None:
        return _SIMPLE.get(name, f"structure {name}")
    return f"a design with {name} exists: {pattern.meaning}"
