"""All designs with a pattern as text for a reader."""

from collections.abc import Mapping, Sequence

from tmsopt.global_search import Completeness
from tmsopt.problem import unit_at
from tmsopt.problem.verdict.stability import CROSSING
from tmsopt.report.text import columns, number
from tmsopt.search.all_designs import Coverage, Every


def every_table(every: Every) -> str:
    """All designs with a pattern, one column each, and what the proof or the search says about others.

    Example:
        >>> every = tmsopt.solve_all("problems/optimised_benchmark.toml")
        >>> print(tmsopt.report.every_table(every).splitlines()[1])
        locate EP4: ...1 solution in the box...

    More: docs/how_to/all_designs.md
    """
    found, coverage, proof = every.solutions, every.coverage, every.completeness
    known = proof is not None and proof.complete
    many = f"{len(found)} solution{'' if len(found) == 1 else 's'}"
    effort = f"{proof.boxes} boxes, {proof.seconds:.2g} s" if proof else ""
    if not found:
        none = f"no design in the box and within the limits has the pattern (proved; {effort})"
        lines = [none if known else "no single solution was met"]
    else:
        problem = found[0].problem
        names = [n for n in found[0].parameters if n in problem.free]
        rows = [("", *(str(k) for k in range(1, len(found) + 1)))]
        off: Sequence[Mapping[str, float]] = every.errors or ({},) * len(found)
        rows += [(n, *(number(s.parameters[n], e.get(n, 0.0)) for s, e in zip(found, off, strict=True))) for n in names]
        each = [unit_at(problem.posed, "abscissa", s.parameters) for s in found]
        decays = [
            number(s.abscissa / unit.one, e.get("abscissa", 0.0) / unit.one)
            for s, unit, e in zip(found, each, off, strict=True)
        ]
        rows += [(f"abscissa {each[0].text}".rstrip(), *decays), ("structure", *(s.structure for s in found))]
        rows += [("met", *(str(h) for h in coverage.hits))] if coverage else []
        rows += [("proved", *("yes" if p else "no" for p in every.proved))] if any(every.proved) and not known else []
        all_of_them = f"these are all: {many} in the box (proved; {effort})"
        lines = [problem.title or "untitled problem", f"locate {problem.locate}: {all_of_them if known else many}"]
        lines[-1] += "" if known else " in the box"
        lines += ["", *columns(rows), ""]
    lines += _proof_lines(proof, effort) if proof else []
    lines += _search_lines(coverage) if coverage else []
    return "\n".join(line.rstrip() for line in lines).rstrip()


def _proof_lines(proof: Completeness, effort: str) -> list[str]:
    lines = [
        f"solution {k} lies on a limit, {limit}, as far as 25 digits tell: it may be just beyond"
        for k, limit in enumerate(proof.limits, start=1)
        if limit
    ]
    if proof.complete:
        return lines
    many = f"; {len(proof.designs)} proved" if proof.designs else ""
    lines.append(f"proof that these are all: none, {proof.reason}{f' ({effort}{many})' if proof.boxes else ''}")
    for place in proof.undecided:
        at = ", ".join(f"{n} {number(lo)} … {number(hi)}" for n, (lo, hi) in place.ranges.items())
        lines.append(f"  undecided: {at}")
    return lines


def _search_lines(coverage: Coverage) -> list[str]:
    doubt = (
        f"; {coverage.singular} ended at designs with the pattern where its equations are singular: one of a "
        "continuum of solutions, or one where two meet (tmsopt solve shows one)"
        if coverage.singular
        else ""
    )
    crossed = [f"{coverage.crossings} starts ended where roots meet in a {CROSSING}"] if coverage.crossings else []
    return [
        *crossed,
        f"coverage of a search: {coverage.starts} starts over the box{doubt}; "
        f"{coverage.expected:.2f} solutions to be expected in all; "
        f"the chance that one more start finds another is below {coverage.chance:.2g} (95 % confidence; no proof)",
    ]
