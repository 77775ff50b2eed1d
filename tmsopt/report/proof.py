"""A proof as text."""

import re
from fractions import Fraction

from tmsopt.algebra.balls import Number, fraction
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import units_of
from tmsopt.proofs.facts import NOTHING, Verdict
from tmsopt.proofs.proof import Proof
from tmsopt.report.text import columns

_OF_OTHERS = re.compile(r"(.*\.)?[bcdW]\d+")  # of factors whose roots are listed


def proof_text(problem: Posed, proof: Proof) -> str:
    """What is proved, the numbers with their radii, and what they were taken for.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> print(tmsopt.report.proof_text(design.problem.posed, tmsopt.prove(design)).splitlines()[1])
        proved: a design with EP4 exists: 4-fold real root

    More: docs/explanation/proofs.md
    """
    lines = [problem.title or "untitled problem"]
    lines.append(f"{'proved' if proof.proved else 'not proved'}: {proof.claim}")
    if proof.reason:
        lines.append(f"why: {proof.reason}")
    if problem.scenarios or problem.tolerances:
        lines.append("of the worst case that was found")
    if proof.parameters:
        lines += _numbers(problem, proof) + _place(problem, proof) + _facts(proof) + _held(problem, proof)
    return "\n".join(line.rstrip() for line in lines)


def _numbers(problem: Posed, proof: Proof) -> list[str]:
    """What was solved for, and the roots, under a heading where they are the stored design's."""
    rows = number_rows(problem, proof)
    head = ["", "the design as stored:"] if proof.stored and proof.reason else [""]
    return [*head, *columns(rows), ""] if rows else [""]


def number_rows(problem: Posed, proof: Proof) -> list[tuple[str, str, str, str]]:
    """What was solved for, and the roots: name, decimal, radius, unit.

    Example:
        >>> design = tmsopt.solve("problems/ep4.toml")
        >>> name, value, *_ = tmsopt.report.number_rows(design.problem.posed, tmsopt.prove(design))[1]
        >>> name, value  # the square root of 2
        ('chi_B', '1.41421356237309504880168872420...')

    More: docs/explanation/proofs.md
    """
    rows = []
    units = _units(problem, proof)
    per = units.get("abscissa", "")
    for name in proof.moved:
        unit = problem.parameter_set[name].unit
        rows.append((name, *_cells(proof.parameters[name]), "" if unit == "1" else unit))
        if name in proof.tangents:
            rows.append((f"tan({name})", *_cells(proof.tangents[name]), ""))
    own = ((name, x) for name, x in proof.unknowns.items() if not _OF_OTHERS.fullmatch(name))
    rows += [(name, *_cells(x), units.get(name, "")) for name, x in own]
    if proof.abscissa:
        rows.append(("abscissa", *_cells(proof.abscissa), per))
    if proof.eigenfrequencies:
        for omega in proof.eigenfrequencies:
            times = f" ({omega.multiplicity}-fold)" if omega.multiplicity > 1 else ""
            rows += [(f"eigenfrequency{times}, re", *_cells(omega.re), ""), ("  im", *_cells(omega.im), "")]
        return rows
    told = {number.value for number in proof.unknowns.values()}
    for root in (r for r in proof.roots if r.re.value not in told or r.im.value != "0"):
        times = f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""
        if root.im.value == "0":
            rows.append((f"root{times}", *_cells(root.re), per))
        elif not root.im.value.startswith("-"):
            rows += [(f"pair{times}, re", *_cells(root.re), per), ("  im ±", *_cells(root.im), per)]
    return rows


def _units(problem: Posed, proof: Proof) -> dict[str, str]:
    """The unit of each number that has one: of the unknowns of a pattern, powers of that of the roots."""
    units = units_of(problem)
    per = units.get("abscissa", "")
    if per and proof.unknowns:
        pattern = pattern_of(problem.model, proof.pattern)
        for name, power in zip(pattern.unknowns, pattern.powers, strict=True):
            unit = per if power == 1 else f"{per}^{power}"
            units[f"{proof.pattern}.{name}" if f"{proof.pattern}.{name}" in proof.unknowns else name] = unit
    return units


def _place(problem: Posed, proof: Proof) -> list[str]:
    """How near, and how alone."""
    if proof.method == "exact factorisation":
        return ["method: square-free factorisation of the polynomial, whose coefficients are fractions"]
    if not proof.moved and proof.method != "Krawczyk":
        return ["method: roots of the design as stored, isolated in balls"]
    return [
        "method: Krawczyk's interval Newton test on a_k = a0 c_k"
        + (" and the == constraints" if len(proof.unknowns) + len(proof.moved) > problem.model.degree else ""),
        f"located to {proof.radius:.1e} before rounding to these digits; the only one within {proof.uniqueness:.2g}",
        f"the stored design is {proof.distance:.1e} from it; rounding explains up to {proof.explained:.1e}",
    ]


def _facts(proof: Proof) -> list[str]:
    of = " (of the design as stored)" if proof.stored and proof.reason else ""
    damped = [] if proof.eigenfrequencies else [_verdict(f"heavily damped{of}", proof.heavily_damped)]
    asked = "EP" in proof.pattern and proof.defective != NOTHING
    said = asked or proof.geometric_multiplicity is not None
    defective = [_verdict(f"defective{of}", proof.defective)] if said else []
    facts = [*defective, _verdict(f"stable{of}", proof.stable), *damped, _verdict("in the box", proof.inside)]
    return facts + [f"{name}: {verdict}" for name, verdict in proof.limits.items()]


def _held(problem: Posed, proof: Proof) -> list[str]:
    """Numbers that were taken exactly, and a word on angles."""
    exact = [*(f"{name} = {_fraction(value)}" for name, value in proof.held.items()), *proof.numbers]
    if not exact:
        return []
    lines = [f"taken exactly: {', '.join(exact)}"]
    of = problem.parameter_set
    angles = [n for n in proof.held if n in of.names and of[n].tangent and n not in proof.stated]
    angles = [n for n in angles if proof.parameters[n].value != "0"]
    if angles:
        lines.append(f"  {', '.join(angles)}: the decimal of the double in radians, not an angle in degrees")
    return lines


def _fraction(text: str) -> str:
    """A fraction; a decimal where that is shorter."""
    try:
        decimal = fraction(Fraction(text), 30)
    except ValueError:  # degrees
        return text
    return decimal.value if decimal.radius == "0" and len(decimal.value) <= len(text) + 1 else text


def _cells(number: Number) -> tuple[str, str]:
    return number.value, "exact" if number.radius == "0" else f"± {number.radius}"


def _verdict(what: str, verdict: Verdict) -> str:
    answer = {True: "yes", False: "no", None: "cannot be told"}[verdict.holds]
    return f"{what}: {answer}, {verdict.words}"
