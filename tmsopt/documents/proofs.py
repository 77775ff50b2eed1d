"""Documents of proofs, and of all designs with a pattern of roots."""

import re
from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

from tmsopt import plots
from tmsopt.algebra.balls import Number, fraction
from tmsopt.documents.blocks import (
    Badge,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
    format_bool,
    write_verdict,
)
from tmsopt.documents.design_rows import convert_to_si, format_multiplicity, tabulate_parameters
from tmsopt.documents.solution import write_bicycle, write_growth_picture
from tmsopt.documents.tables import write_question
from tmsopt.global_search import Completeness
from tmsopt.global_search.chain_equations import has_chain_proof
from tmsopt.models import Model
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem import unit_at
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import round_one_way, units_of
from tmsopt.proofs.facts import NOT_CHECKED, Verdict
from tmsopt.proofs.proof import Proof
from tmsopt.search.all_designs import Coverage, Every

if TYPE_CHECKING:
    from tmsopt.problem import Solution

_MAX_ERROR = 1e-3  # of a parameter in the list of designs, as a share of its range
_FACTOR_COEFFICIENT = re.compile(r"(.*\.)?[bcdW]\d+")
"""Names of coefficients of factors. Documents list the roots of the factors instead."""


def write_proof(proof: Proof, level: Level, *, design: "Solution | None" = None) -> Parts:
    """Write the claim, the proved numbers with their radii, the facts that follow, and the numbers assumed exact.

    Args:
        design: the solution that was proved; a page then shows its pictures and parameters.
    """
    verdict, stable = write_verdict(proof.proved, "proved"), write_verdict(proof.stable.holds, "stable")
    yield verdict, proof.pattern or "nothing", f"{proof.digits} digits", stable
    yield Sentence(proof.claim, verdict.text, verdict.tone)
    yield Sentence(proof.reason, "why")
    if proof.problem is None:
        return
    problem = proof.problem.posed
    if problem.scenarios or problem.tolerances:
        yield "for the worst case found"
    if not proof.parameters:
        return
    if rows := list_numbers(problem, proof):
        yield Chapter("digits", width="wide")
        if proof.stored and proof.reason:
            yield f"the stored {problem.model.noun}:"
        head = ("number", "decimal", "radius", "unit")
        yield TableBlock((head, *rows), f"Numbers that were proved, to {proof.digits} digits", priorities=(9, 8, 5, 6))
    if level == "page":
        yield Chapter("roots")
        yield Figure(plots.draw_roots, proof, "Roots in the complex plane")
    yield Chapter("method")
    yield from _describe_method(problem, proof)
    yield Chapter("facts")
    yield from _write_facts(proof, problem.model)
    yield Chapter("exact", "Exact numbers")
    yield from _write_exact_numbers(problem, proof)
    if level == "page" and design is not None:
        yield from write_bicycle(design)
        yield Chapter("parameters", width="wide")
        yield tabulate_parameters(design, convert_to_si(design))
        yield from write_growth_picture(design)
    elif level == "page":
        yield from write_question(problem)


def list_numbers(problem: Posed, proof: Proof) -> list[tuple[str, str, str, str]]:
    """List the name, decimal, radius and unit of each number that was solved for and of each root."""
    return [
        (name, x.value if float(x.value) else "0", "exact" if x.radius == "0" else f"± {x.radius}", unit)
        for name, x, unit in _find_numbers(problem, proof)
    ]


def _find_numbers(problem: Posed, proof: Proof) -> Iterator[tuple[str, Number, str]]:
    units = _find_units(problem, proof)
    rate_unit = units.get("abscissa", "")
    for name in proof.moved:
        yield name, proof.parameters[name], units.get(name, "")
        if name in proof.tangents:
            yield f"tan({name})", proof.tangents[name], ""
    for name, x in proof.unknowns.items():
        if not _FACTOR_COEFFICIENT.fullmatch(name):
            yield name, x, units.get(name, "")
    if proof.abscissa:
        yield "largest Im ω" if problem.model.is_complex else "abscissa", proof.abscissa, rate_unit
    for omega in proof.eigenfrequencies:
        yield f"eigenfrequency{format_multiplicity(omega.multiplicity)}, re", omega.re, ""
        yield "  im", omega.im, ""
    listed_values = {number.value for number in proof.unknowns.values()}
    for root in () if proof.eigenfrequencies else proof.roots:
        multiplicity = format_multiplicity(root.multiplicity)
        if root.im.value != "0" and not root.im.value.startswith("-"):
            yield f"pair{multiplicity}, re", root.re, rate_unit
            yield "  im ±", root.im, rate_unit
        elif root.im.value == "0" and root.re.value not in listed_values:
            yield f"root{multiplicity}", root.re, rate_unit


def _find_units(problem: Posed, proof: Proof) -> dict[str, str]:
    """Map each number to its unit; unknowns of a pattern have powers of the unit of the roots."""
    units = units_of(problem)
    rate_unit = units.get("abscissa", "")
    if rate_unit and proof.unknowns:
        pattern = pattern_of(problem.model, proof.pattern)
        for name, power in zip(pattern.unknowns, pattern.powers, strict=True):
            unit = rate_unit if power == 1 else f"{rate_unit}^{power}"
            units[f"{proof.pattern}.{name}" if f"{proof.pattern}.{name}" in proof.unknowns else name] = unit
    return units


def _describe_method(problem: Posed, proof: Proof) -> Parts:
    """Describe the method of the proof, the error of the stored design, and the region without another solution."""
    noun = problem.model.noun
    if proof.method == "exact factorisation":
        yield Sentence("square-free factorisation of the polynomial, whose coefficients are fractions", "method")
    elif not proof.moved and proof.method != "Krawczyk":
        yield Sentence(f"roots of the stored {noun}, isolated by interval arithmetic", "method")
    else:
        has_constraints = len(proof.unknowns) + len(proof.moved) > problem.model.degree
        equations = "a_k = a0 c_k" + (" and the == constraints" if has_constraints else "")
        equations += ", where c_k are the coefficients of the pattern"
        if has_chain_proof(problem, proof.pattern):
            equations = "of the Jordan chain"
        yield Sentence(f"Krawczyk's interval Newton test on the equations {equations}", "method")
        error, distance = round_one_way(proof.radius, True, 2), round_one_way(proof.uniqueness, False, 2)
        uniqueness = f"every other such {noun} differs in some number by more than {distance:.2g}"
        yield f"error at most {error:.1e} before rounding to these digits; {uniqueness}"
        rounding_text = f"rounding alone can cause a difference of {proof.explained:.1e}"
        yield f"the stored {noun} differs from the proved one by {proof.distance:.1e}; {rounding_text}"


def _write_facts(proof: Proof, model: Model) -> Parts:
    suffix = f" (of the stored {model.noun})" if proof.stored and proof.reason else ""
    shows_defect = "EP" in proof.pattern and proof.defective != NOT_CHECKED
    if shows_defect or proof.geometric_multiplicity is not None:
        yield _write_fact(f"defective{suffix}", proof.defective)
    yield _write_fact(f"{'decaying' if model.is_complex else 'stable'}{suffix}", proof.stable)
    if not proof.eigenfrequencies:
        yield _write_fact(f"heavily damped{suffix}", proof.heavily_damped)
    yield _write_fact("within the ranges", proof.inside)
    yield from (Sentence(str(verdict), name) for name, verdict in proof.limits.items())


def _write_exact_numbers(problem: Posed, proof: Proof) -> Parts:
    """Write the numbers that are assumed to be exact, and a remark on angles."""
    exact_values = (f"{name} = {_format_fraction(value)}" for name, value in proof.held.items())
    yield Sentence(", ".join((*exact_values, *proof.numbers)), "exact numbers")
    exact_angles = {*proof.stated, *problem.typed(problem.fixed)}
    tangents = {p.name for p in problem.parameter_set.parameters if p.tangent} - exact_angles
    if angles := [n for n in proof.held if n in tangents and proof.parameters[n].value != "0"]:
        yield Sentence("exact as the double-precision number in radians, not as degrees", ", ".join(angles))


def _format_fraction(text: str) -> str:
    """Write a fraction, as a decimal if the decimal is exact and short."""
    try:
        decimal = fraction(Fraction(text), 30)
    except ValueError:  # degrees
        return text
    return decimal.value if decimal.radius == "0" and len(decimal.value) <= len(text) + 1 else text


def _write_fact(label: str, verdict: Verdict) -> Sentence:
    answer = {True: "yes", False: "no", None: "not decided"}[verdict.holds]
    return Sentence(f"{answer}, {verdict.words}", label)


def write_every(result: Every, _level: Level) -> Parts:
    """Write all designs with a pattern, each in a column, and whether a proof or a search excludes further designs."""
    solutions, coverage, proof = result.solutions, result.coverage, result.completeness
    is_complete = proof is not None and proof.complete
    verdict = Badge("proved to be all", "good") if is_complete else "not proved to be all"
    yield count_things(solutions, "solution"), verdict
    effort = f"{proof.boxes} boxes, {proof.seconds:.2g} s" if proof else ""
    if proof and proof.total is not None:
        effort = f"the discriminant has {proof.total} zeros, each one proved, {proof.seconds:.2g} s"
    if not solutions:
        no_solution = f"no parameters within the ranges and limits have the pattern (proved; {effort})"
        yield Sentence(no_solution if is_complete else "no isolated solution was found", tone="answer")
    else:
        count_text = f"{count_things(solutions, 'solution')} within the ranges"
        count_text += f", no other exists (proved; {effort})" if is_complete else ""
        yield Sentence(count_text, f"locate {solutions[0].problem.locate}", "answer")
        yield Chapter("designs", width="wide")
        yield TableBlock(_list_designs(result, is_complete), "Designs with the pattern")
    yield Chapter("proof")
    yield from _describe_proof(proof, effort) if proof else ()
    yield from _describe_coverage(coverage) if coverage else ()


def _list_designs(result: Every, is_complete: bool) -> list[Row]:
    """List the designs as columns: parameters, abscissa, structure, and how many starts reached each design."""
    solutions, problem = result.solutions, result.solutions[0].problem.posed
    names = [n for n in solutions[0].parameters if n in problem.free]
    pairs = [*zip(solutions, result.errors or [{} for _ in solutions], strict=True)]
    units = [unit_at(problem, "abscissa", s.parameters) for s in solutions]
    rows: list[Row] = [(problem.model.noun, *(str(k) for k in range(1, len(solutions) + 1)))]
    most = {n: _MAX_ERROR * (hi - lo) for n, (lo, hi) in problem.free.items()}
    rows += [(n, *(Cell(s.parameters[n], error=min(e.get(n, 0.0), most[n])) for s, e in pairs)) for n in names]
    abscissas = [Cell(s.abscissa, u, error=e.get("abscissa", 0.0)) for (s, e), u in zip(pairs, units, strict=True)]
    rows += [(f"abscissa {units[0].text}".rstrip(), *abscissas), ("structure", *(s.structure for s in solutions))]
    rows += [("starts that reached it", *map(str, result.coverage.hits))] if result.coverage else []
    rows += [("proved", *map(format_bool, result.proved))] if any(result.proved) and not is_complete else []
    return rows


def _describe_proof(proof: Completeness, effort: str) -> Iterator[str]:
    for k, limit in enumerate(proof.limits, start=1):
        if limit:
            yield f"solution {k} lies on the limit {limit} to 25 digits: it may be just outside"
    if proof.complete:
        return
    proved_text = f"; {len(proof.designs)} proved" if proof.designs else ""
    yield f"no proof that these are all: {proof.reason}{f' ({effort}{proved_text})' if proof.boxes else ''}"
    for box in proof.undecided:
        yield f"undecided: {', '.join(f'{n} {Cell(lo)} … {Cell(hi)}' for n, (lo, hi) in box.ranges.items())}"


def _describe_coverage(coverage: Coverage) -> Iterator[str]:
    if coverage.crossings:
        yield f"{coverage.crossings} starts ended where a multiple eigenvalue has several eigenvectors: no EP"
    singular_text = f"; {coverage.singular} ended where the equations of the pattern are singular, because "
    singular_text += "the solutions form a continuum or two of them meet (tmsopt solve shows one)"
    yield (
        f"coverage of a search: {coverage.starts} starts over the ranges{singular_text if coverage.singular else ''}; "
        f"{coverage.expected:.2f} solutions are expected in total; "
        f"the chance that one more start finds another is below {coverage.chance:.2g} (95 % confidence; no proof)"
    )
