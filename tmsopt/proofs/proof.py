"""Proves that the design that a problem asks for exists. Solves the problem first."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

import flint

from tmsopt.algebra.balls import Number, ProvedRoot, fraction, number
from tmsopt.algebra.krawczyk import ProofFailed
from tmsopt.errors import Fault, InputError, count_faults
from tmsopt.global_search.chain_equations import has_chain_proof
from tmsopt.models.exact import ExactDesign, as_exact_design
from tmsopt.models.names import number_text
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.cases import Case
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.real_form import has_real_form, real_form
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import units_of
from tmsopt.problem.verdict.stability import CROSSING, describe_crossing
from tmsopt.program.options import SolveOptions, documents_options, make_options
from tmsopt.progress import begin
from tmsopt.proofs.existence import ProvedDesign, enclose_stored, prove_exactly, prove_nearby
from tmsopt.proofs.factorisation import multiple_roots
from tmsopt.proofs.facts import (
    NOT_CHECKED,
    Verdict,
    box_verdict,
    eigenvector_verdict,
    heavy_damping_verdict,
    limit_verdicts,
    stability_verdict,
)
from tmsopt.records import Printable, Table, plain
from tmsopt.roots import PATTERNS, Pattern, Root
from tmsopt.roots.patterns.complex_patterns import as_complex_pattern
from tmsopt.roots.patterns.naming import find_patterns, has_pattern
from tmsopt.search.solve import solve_any_status

DIGITS = 30
"""Default number of digits."""

MAX_DIGITS = 1000
_QUARTIC = 4  # the degree of `PATTERNS`
_EXTRA_DIGITS = 50  # decimal digits of the arithmetic beyond twice the requested ones, for a design taken as stored

_UNKNOWN = Verdict(None, "only the multiple roots of large or complex matrices are enclosed")

_SIMPLE_CLAIMS = {
    "pair": "the rightmost roots are a simple complex pair",
    "real": "the rightmost root is real and simple",
    "single": "the least damped eigenfrequency is simple",
}


@dataclass(frozen=True, repr=False)
class Proof(Printable):
    """A proof about a design in ball arithmetic, as plain data with decimals as text.

    Attributes:
        claim: the statement to prove.
        proved: whether it is proved.
        reason: if not, what failed and what to do.
        pattern: the root pattern, ``pair`` or ``real``.
        method: ``Krawczyk``, ``exact factorisation``, ``isolated roots`` or ``none``.
        digits: number of digits requested.
        stored: whether all numbers below describe the stored design, because the claim is about it or is not proved.
        parameters: every parameter of the proved design (rad, SI units).
        tangents: tangents of its angles, in which the equations are solved.
        unknowns: factor coefficients of the pattern, and quantities with an equation of their own.
        moved: parameters that were solved for; the others are held.
        held: parameter, or ``tan(parameter)`` → its exact value as a fraction.
        stated: the held numbers that the user gave exactly.
        numbers: non-integers in formulas, as written; each stands for its decimal.
        radius: the largest radius among the numbers solved for.
        uniqueness: distance within which no other solution exists, in each number solved for; inf if no number was
            solved for.
        distance: how far the stored value of a parameter is from the proved one, for the parameter with the largest
            ratio of this distance to the distance that rounding explains.
        explained: how far rounding of the stored numbers may move this parameter.
        roots: all roots with exact multiplicities, rightmost first; empty if the balls of two roots overlap. For large
            matrices only the multiple roots of the pattern.
        eigenfrequencies: ω = i s of a complex system, in the order of the roots.
        abscissa: the largest real part.
        geometric_multiplicity: the most independent eigenvectors of a multiple root; None if unknown.
        defective: whether every multiple root has fewer eigenvectors than its multiplicity; at an exceptional point it
            has one.
        stable: whether all roots lie left of the imaginary axis.
        heavily_damped: whether all roots are real and negative.
        inside: whether the proved design lies in the problem's box.
        limits: inequality of the problem → ``met``, ``violated``, ``binds`` or ``not decided``, at this design.
        seconds: time used.
        problem: the problem of the design.

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
    defective: Verdict = NOT_CHECKED
    stable: Verdict = NOT_CHECKED
    heavily_damped: Verdict = NOT_CHECKED
    inside: Verdict = NOT_CHECKED
    limits: Table[str] = Table()
    seconds: float = 0.0
    problem: Problem | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: decimals as text, summaries as numbers, missing values as None."""
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
    design: ProblemSource,
    digits: int = DIGITS,
    *,
    exact: Mapping[str, Any] | None = None,
    **options: Unpack[SolveOptions],
) -> Proof:
    """Prove in ball arithmetic that the design a problem asks for exists, and decide its stability.

    The equations are a_k = a0 c_k, where c_k are the coefficients of the pattern, and the problem's equalities. An
    interval Newton test (Krawczyk) proves that they have exactly one solution within a stated radius, and that the
    stored numbers are its rounding. If the proof fails, `Proof.reason` says why.

    Args:
        design: a solution; or a problem or its file, solved first.
        digits: number of digits of every result, 1 to 1000.
        exact: parameter, or ``tan(lambda_s)`` → its exact value: an int, a Fraction, a ``flint.fmpq``, or text such as
            ``"-2/5"`` or ``"20 deg"``. Other numbers stand for the shortest decimals that print them.
        options: options of `solve`, e.g. ``starts``; with a solution, only ``progress``.

    Raises:
        InputError: if the problem has no objective or pattern, a solution comes with other options than ``progress``,
            `digits` is out of range, or exact numbers differ from the design's.

    Example:
        >>> tmsopt.prove("problems/ep4.toml", digits=40).parameters["chi_B"].value[:42]  # the square root of 2
        '1.4142135623730950488016887242096980785696'

    More: docs/explanation/proofs.md
    """
    rejected_options = [name for name in options if name != "progress"]
    if isinstance(design, Solution) and rejected_options:
        found = f"found {', '.join(rejected_options)}"
        message = f"{found}; accepted with a solution: progress; to set solver options, give the problem"
        raise InputError([Fault(message, ("options",))])
    solve_options = make_options(options, SolveOptions)
    solution = solve_any_status(design, solve_options)
    problem = solution.problem.posed
    if solution.status != "optimal":
        crossings = [describe_crossing(m) for m in solution.meetings if not m.exceptional]
        reason = f"the problem is not solved ({solution.status}): there is no {problem.model.noun} to prove"
        if problem.pattern and crossings:
            reason = f"none found: the roots meet in {crossings[0]}"
        claim = f"a {problem.model.noun} of '{problem.title or 'the problem'}' exists"
        return Proof(claim, False, reason, digits=digits, problem=problem.problem)
    begin(solve_options.progress, f"proving to {digits} digits")
    structure, roots = solution.structure, solution.roots
    return prove_design(problem, solution.parameters, structure, digits, exact, solution.worst, roots)


def prove_design(
    problem: Posed,
    parameters: Mapping[str, float],
    structure: str,
    digits: int = DIGITS,
    exact: Mapping[str, Any] | None = None,
    case: Case | None = None,
    roots: Sequence[Root] = (),
) -> Proof:
    """Prove the pattern that a problem locates or that a design's roots show, and decide its stability.

    Args:
        parameters: the stored design; the proof searches near it.
        structure: structure of the rightmost roots: name of a pattern, ``pair`` or ``real``.
        digits: number of digits of every result.
        exact: parameter, or ``tan(parameter)`` → its exact value; such a parameter is held. Other numbers stand for
            the shortest decimals that print them.
        case: the case of scenarios and tolerances to which the structure belongs.
        roots: roots of the design with multiplicities; needed for the full structure except for quartics.

    Raises:
        InputError: if `digits` is out of range, or exact numbers differ from the design's.
    """
    if faults := count_faults("digits", digits, 1, MAX_DIGITS):
        raise InputError(faults)
    digits = int(digits)
    began = time.perf_counter()
    case_parameters = case.applied(parameters) if case else dict(parameters)
    typed_texts = {n: text for n, text in problem.typed(case_parameters).items() if n in problem.fixed}
    design = as_exact_design(problem.parameter_set, case_parameters, exact, typed_texts)
    with flint.ctx.workdps(2 * digits + _EXTRA_DIGITS):
        patterns = _candidate_patterns(problem, structure, roots)
        # Constraints belong to the nominal design or to all cases, so a proof for a single case drops them.
        claim_problem = problem.nominal.derive(constraints={}) if case and (case.at or case.offset) else problem
        proof = _prove_first(claim_problem, design, case_parameters, structure, patterns, digits)
        return replace(proof, problem=problem.problem, seconds=time.perf_counter() - began)


def _prove_first(
    problem: Posed,
    design: ExactDesign,
    case_parameters: Mapping[str, float],
    structure: str,
    patterns: Sequence[Pattern],
    digits: int,
) -> Proof:
    """Return the first proof that succeeds; otherwise the reason and the facts about the design as stored."""
    reasons: list[str] = []
    for pattern in patterns or ([] if structure in _SIMPLE_CLAIMS else _exact_patterns(problem, design)):
        if exact := prove_exactly(problem, pattern, design):
            return _assemble(problem, design, pattern.name, pattern, exact, digits)
    for pattern in patterns:
        try:
            proved_design = prove_nearby(problem, pattern, design, case_parameters, digits)
        except ProofFailed as failure:
            reasons.append(str(failure))
        else:
            return _assemble(problem, design, pattern.name, pattern, proved_design, digits)
    name = problem.locate or structure
    expected_pattern = next((p for p in patterns if p.name == name), None)
    stored_design = enclose_stored(problem, design)
    if stored_design is None:
        is_covered = has_real_form(problem.model)
        doubt = "a0 may be 0: a root may be at infinity" if is_covered else "of these matrices only patterns are proved"
        reason = reasons[0] if reasons else doubt
        return Proof(_state_claim(name, expected_pattern, problem.model.noun), False, reason, name, digits=digits)
    reasons = reasons or _simple_doubts(problem, structure, stored_design)
    return _assemble(problem, design, name, expected_pattern, stored_design, digits, reasons, stored=True)


def _candidate_patterns(problem: Posed, structure: str, roots: Sequence[Root]) -> list[Pattern]:
    """List the patterns to prove: those of the roots, if they imply the located pattern, and then the located one."""
    target = problem.pattern
    if not has_real_form(problem.model):
        return [target] if target else []
    form = real_form(problem)
    quartic = PATTERNS if form.problem.model.degree == _QUARTIC and form.carrier is None else {}
    real_roots = form.real_roots(roots)
    patterns = find_patterns(real_roots) if roots else [quartic[structure]] if structure in quartic else []
    if target and not (has_pattern(real_roots, target.form) if roots else target.form == form.real_name(structure)):
        patterns = []
    user_patterns = [quartic.get(p.name, p) for p in patterns]
    if problem.model.is_complex:
        user_patterns = [p for p in map(as_complex_pattern, user_patterns) if has_chain_proof(problem, p.name)]
    return list({p.name: p for p in [*user_patterns, *([target] if target else [])]}.values())


def _exact_patterns(problem: Posed, design: ExactDesign) -> list[Pattern]:
    """The pattern of all multiple roots of a design in fractions, if any."""
    if not has_real_form(problem.model):
        return []
    form = real_form(problem)
    a = design.coefficients(form.problem.model, problem.parameter_set)
    name = multiple_roots(a) if a else ""
    return [pattern_of(problem.model, form.user_name(name))] if name else []


def _simple_doubts(problem: Posed, structure: str, proved_design: ProvedDesign) -> list[str]:
    """List why the structure of a design without multiple roots is not proved; empty if it is proved."""
    if structure not in _SIMPLE_CLAIMS:
        return [f"double precision cannot decide the structure {structure}; locate the pattern you expect"]
    roots = proved_design.factorisation.roots
    if roots is None:
        return ["some roots are equal or too close to isolate; locate the pattern you expect"]
    other_roots = roots[1:] if roots[0].is_real else roots[2:]
    if roots[0].is_real == (structure == "real") and all(z.re < roots[0].re for z in other_roots):
        return []
    return [f"the rightmost root of the design as stored is not certainly {structure}"]


def _assemble(
    problem: Posed,
    design: ExactDesign,
    name: str,
    pattern: Pattern | None,
    proved_design: ProvedDesign,
    digits: int,
    reasons: Sequence[str] = (),
    stored: bool = False,
) -> Proof:
    """Collect the numbers and verdicts of a design in a `Proof`; `reasons` say why it is not proved."""
    numbers = {
        n: number(ball, digits)
        if n in (*proved_design.moved, *design.tangents) or (exact_value := design.values[n].fraction) is None
        else fraction(exact_value, digits)
        for n, ball in proved_design.parameters.items()
    }
    has_all_roots = has_real_form(problem.model)  # of large matrices only the multiple roots are enclosed
    abscissa = proved_design.factorisation.abscissa if has_all_roots else None
    is_real = not problem.model.is_complex
    # For a complex H, these are unknowns of a real matrix that the user did not state.
    hidden_unknowns = () if is_real or pattern is None else pattern.unknowns
    hidden_unknowns = (*hidden_unknowns, *(f"{pattern.name}.{n}" for n in hidden_unknowns)) if pattern else ()
    roots = proved_design.chain_roots
    if has_all_roots:
        roots = real_form(problem).user_roots(proved_design.factorisation.roots or ())
    geometric_multiplicity, defective = eigenvector_verdict(problem, design, proved_design)
    if not reasons and geometric_multiplicity is not None and geometric_multiplicity > 1 and "EP" in name:
        reasons = [f"{'not an EP' if defective.holds else CROSSING}: {defective.words}"]
    return Proof(
        claim=_state_claim(name, pattern, problem.model.noun),
        proved=not reasons,
        reason=reasons[0] if reasons else "",
        pattern=name,
        method=proved_design.method,
        digits=digits,
        stored=stored,
        parameters=Table({n: numbers[n] for n in problem.parameter_set.names}),
        tangents=Table({n: number(ball, digits) for n, ball in proved_design.tangents.items()}),
        unknowns=Table(
            {n: number(ball, digits) for n, ball in proved_design.unknowns.items() if n not in hidden_unknowns}
        ),
        moved=proved_design.moved,
        held=Table(dict(design.text(n) for n in problem.parameter_set.names if n not in proved_design.moved)),
        stated=design.given_exactly,
        numbers=_formula_numbers(problem),
        radius=proved_design.radius,
        uniqueness=proved_design.uniqueness,
        distance=proved_design.distance,
        explained=proved_design.explained,
        roots=tuple(ProvedRoot(number(z.re, digits), number(z.im, digits), z.multiplicity) for z in roots),
        eigenfrequencies=tuple(
            ProvedRoot(number(-z.im, digits), number(z.re, digits), z.multiplicity) for z in (() if is_real else roots)
        ),
        abscissa=None if abscissa is None else number(abscissa, digits),
        geometric_multiplicity=geometric_multiplicity,
        defective=defective,
        stable=stability_verdict(proved_design.factorisation, not is_real) if has_all_roots else _UNKNOWN,
        heavily_damped=heavy_damping_verdict(proved_design.factorisation) if is_real and has_all_roots else NOT_CHECKED,
        inside=box_verdict(problem, design, proved_design),
        limits=Table(limit_verdicts(problem, proved_design)),
    )


def _formula_numbers(problem: Posed) -> tuple[str, ...]:
    """The numbers in formulas that are not integers, as texts."""
    constants = [x for c in problem.conditions.values() if c.equality for x in c.formula.constants]
    texts = [text for x in constants if not (text := number_text(x)).lstrip("-").isdigit()]
    return tuple(dict.fromkeys([*problem.model.numbers, *texts]))


def _state_claim(name: str, pattern: Pattern | None, noun: str) -> str:
    if pattern is None:
        return _SIMPLE_CLAIMS.get(name, f"structure {name}")
    return f"a {noun} with {name} ({pattern.meaning}) exists"
