"""Proofs, and all designs with a pattern: what is proved, and to how many digits."""

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
    judge,
    say_whether,
)
from tmsopt.documents.design_rows import convert_to_si, format_multiplicity, tabulate_parameters
from tmsopt.documents.solution import write_bicycle, write_growth_picture
from tmsopt.documents.tables import write_question
from tmsopt.global_search import Completeness
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem import unit_at
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import units_of
from tmsopt.problem.verdict.stability import CROSSING
from tmsopt.proofs.facts import NOT_CHECKED, Verdict
from tmsopt.proofs.proof import Proof
from tmsopt.search.all_designs import Coverage, Every

if TYPE_CHECKING:
    from tmsopt.problem import Solution

_OF_OTHERS = re.compile(r"(.*\.)?[bcdW]\d+")  # of factors whose roots are listed


def write_proof(proof: Proof, level: Level, *, design: "Solution | None" = None) -> Parts:
    """The claim, the numbers with their radii, the facts that follow, and the numbers that were taken exactly.

    Args:
        design: what was proved: a page has its pictures and parameters too.
    """
    verdict, stable = judge(proof.proved, "proved"), judge(proof.stable.holds, "stable")
    yield verdict, proof.pattern or "nothing", f"{proof.digits} digits", stable
    yield Sentence(proof.claim, verdict.text, verdict.tone)
    yield Sentence(proof.reason, "why")
    if proof.problem is None:
        return
    problem = proof.problem.posed
    if problem.scenarios or problem.tolerances:
        yield "for the worst case that was found"
    if not proof.parameters:
        return
    if rows := list_numbers(problem, proof):
        yield Chapter("digits", width="wide")
        if proof.stored and proof.reason:
            yield "the stored design:"
        head = ("number", "decimal", "radius", "unit")
        yield TableBlock((head, *rows), f"Numbers that were proved, to {proof.digits} digits", needs=(9, 8, 5, 6))
    if level == "page":
        yield Chapter("roots")
        yield Figure(plots.draw_roots, proof, "Roots in the complex plane")
    yield Chapter("method")
    yield from _describe_method(problem, proof)
    yield Chapter("facts")
    yield from _write_facts(proof)
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
    """The numbers solved for, and the roots: name, decimal, radius, unit."""
    return [
        (name, x.value if float(x.value) else "0", "exact" if x.radius == "0" else f"± {x.radius}", unit)
        for name, x, unit in _find_numbers(problem, proof)
    ]


def _find_numbers(problem: Posed, proof: Proof) -> Iterator[tuple[str, Number, str]]:
    units = _find_units(problem, proof)
    per = units.get("abscissa", "")
    for name in proof.moved:
        yield name, proof.parameters[name], units.get(name, "")
        if name in proof.tangents:
            yield f"tan({name})", proof.tangents[name], ""
    for name, x in proof.unknowns.items():
        if not _OF_OTHERS.fullmatch(name):
            yield name, x, units.get(name, "")
    if proof.abscissa:
        yield "abscissa", proof.abscissa, per
    for omega in proof.eigenfrequencies:
        yield f"eigenfrequency{format_multiplicity(omega.multiplicity)}, re", omega.re, ""
        yield "  im", omega.im, ""
    listed = {number.value for number in proof.unknowns.values()}
    for root in () if proof.eigenfrequencies else proof.roots:
        times = format_multiplicity(root.multiplicity)
        if root.im.value != "0" and not root.im.value.startswith("-"):
            yield f"pair{times}, re", root.re, per
            yield "  im ±", root.im, per
        elif root.im.value == "0" and root.re.value not in listed:
            yield f"root{times}", root.re, per


def _find_units(problem: Posed, proof: Proof) -> dict[str, str]:
    """The unit of each number that has one: of the unknowns of a pattern, powers of the unit of the roots."""
    units = units_of(problem)
    per = units.get("abscissa", "")
    if per and proof.unknowns:
        pattern = pattern_of(problem.model, proof.pattern)
        for name, power in zip(pattern.unknowns, pattern.powers, strict=True):
            unit = per if power == 1 else f"{per}^{power}"
            units[f"{proof.pattern}.{name}" if f"{proof.pattern}.{name}" in proof.unknowns else name] = unit
    return units


def _describe_method(problem: Posed, proof: Proof) -> Parts:
    """How it was proved, how near the stored design is, and how alone."""
    if proof.method == "exact factorisation":
        yield Sentence("square-free factorisation of the polynomial, whose coefficients are fractions", "method")
    elif not proof.moved and proof.method != "Krawczyk":
        yield Sentence("roots of the stored design, isolated by interval arithmetic", "method")
    else:
        equations = len(proof.unknowns) + len(proof.moved) > problem.model.degree
        also = " and the == constraints" if equations else ""
        equal = "a_k = a0 c_k, c_k the coefficients of the pattern"
        yield Sentence(f"Krawczyk's interval Newton test on the equations {equal}{also}", "method")
        alone = f"no other such design within {proof.uniqueness:.2g} in each number"
        yield f"error at most {proof.radius:.1e} before rounding to these digits; {alone}"
        explained = f"rounding to doubles can explain {proof.explained:.1e}"
        yield f"the stored design differs from it by {proof.distance:.1e}; {explained}"


def _write_facts(proof: Proof) -> Parts:
    of = " (of the stored design)" if proof.stored and proof.reason else ""
    asked = "EP" in proof.pattern and proof.defective != NOT_CHECKED
    if asked or proof.geometric_multiplicity is not None:
        yield _write_verdict(f"defective{of}", proof.defective)
    yield _write_verdict(f"stable{of}", proof.stable)
    if not proof.eigenfrequencies:
        yield _write_verdict(f"heavily damped{of}", proof.heavily_damped)
    yield _write_verdict("in the box", proof.inside)
    yield from (Sentence(str(verdict), name) for name, verdict in proof.limits.items())


def _write_exact_numbers(problem: Posed, proof: Proof) -> Parts:
    """Numbers that were taken exactly, and a word on angles."""
    held = (f"{name} = {_format_fraction(value)}" for name, value in proof.held.items())
    yield Sentence(", ".join((*held, *proof.numbers)), "exact numbers")
    tangents = {p.name for p in problem.parameter_set.parameters if p.tangent} - set(proof.stated)
    if angles := [n for n in proof.held if n in tangents and proof.parameters[n].value != "0"]:
        yield Sentence("the decimal of the double in radians, not an angle in degrees", ", ".join(angles))


def _format_fraction(text: str) -> str:
    """A fraction; a decimal where that is shorter."""
    try:
        decimal = fraction(Fraction(text), 30)
    except ValueError:  # degrees
        return text
    return decimal.value if decimal.radius == "0" and len(decimal.value) <= len(text) + 1 else text


def _write_verdict(label: str, verdict: Verdict) -> Sentence:
    answer = {True: "yes", False: "no", None: "not decided"}[verdict.holds]
    return Sentence(f"{answer}, {verdict.words}", label)


def write_every(every: Every, _level: Level) -> Parts:
    """All designs with a pattern, one column each, and what the proof or the search says about others."""
    found, coverage, proof = every.solutions, every.coverage, every.completeness
    complete = proof is not None and proof.complete
    verdict = Badge("proved to be all", "good") if complete else "not proved to be all"
    yield count_things(found, "design"), verdict
    many = count_things(found, "solution")
    effort = f"{proof.boxes} boxes, {proof.seconds:.2g} s" if proof else ""
    if not found:
        none = f"no design in the box and within the limits has the pattern (proved; {effort})"
        yield Sentence(none if complete else "no isolated solution was found", tone="answer")
    else:
        all_of_them = f"{many} in the box, no other exists (proved; {effort})"
        located = all_of_them if complete else f"{many} in the box"
        yield Sentence(located, f"locate {found[0].problem.locate}", "answer")
        yield Chapter("designs", width="wide")
        yield TableBlock(_list_designs(every, complete), "Designs with the pattern")
    yield Chapter("proof")
    yield from _describe_proof(proof, effort) if proof else ()
    yield from _describe_coverage(coverage) if coverage else ()


def _list_designs(every: Every, complete: bool) -> list[Row]:
    found, problem = every.solutions, every.solutions[0].problem
    names = [n for n in found[0].parameters if n in problem.free]
    pairs = [*zip(found, every.errors or [{} for _ in found], strict=True)]
    units = [unit_at(problem.posed, "abscissa", s.parameters) for s in found]
    rows: list[Row] = [("design", *(str(k) for k in range(1, len(found) + 1)))]
    rows += [(n, *(Cell(s.parameters[n], error=e.get(n, 0.0)) for s, e in pairs)) for n in names]
    decays = [Cell(s.abscissa, u, error=e.get("abscissa", 0.0)) for (s, e), u in zip(pairs, units, strict=True)]
    rows += [(f"abscissa {units[0].text}".rstrip(), *decays), ("structure", *(s.structure for s in found))]
    rows += [("met", *map(str, every.coverage.hits))] if every.coverage else []
    rows += [("proved", *map(say_whether, every.proved))] if any(every.proved) and not complete else []
    return rows


def _describe_proof(proof: Completeness, effort: str) -> Iterator[str]:
    for k, limit in enumerate(proof.limits, start=1):
        if limit:
            yield f"solution {k} lies on a limit, {limit}, as far as 25 digits tell: it may be just beyond"
    if proof.complete:
        return
    many = f"; {len(proof.designs)} proved" if proof.designs else ""
    yield f"no proof that these are all: {proof.reason}{f' ({effort}{many})' if proof.boxes else ''}"
    for place in proof.undecided:
        yield f"undecided: {', '.join(f'{n} {Cell(lo)} … {Cell(hi)}' for n, (lo, hi) in place.ranges.items())}"


def _describe_coverage(coverage: Coverage) -> Iterator[str]:
    if coverage.crossings:
        yield f"{coverage.crossings} starts ended where roots meet in a {CROSSING}"
    singular = f"; {coverage.singular} ended at designs with the pattern where its equations are singular: "
    singular += "one of a continuum of solutions, or one where two meet (tmsopt solve shows one)"
    doubt = singular if coverage.singular else ""
    yield (
        f"coverage of a search: {coverage.starts} starts over the box{doubt}; "
        f"{coverage.expected:.2f} solutions to be expected in all; "
        f"the chance that one more start finds another is below {coverage.chance:.2g} (95 % confidence; no proof)"
    )
