"""The tables of the design benchmarks."""

from collections import Counter
from collections.abc import Iterable, Sequence

from benchmarks.judges.bands import CHECKED, MARGIN, STARTS, Ride
from benchmarks.reports.designs.varied_designs import FEASIBLE, REFERENCE_STARTS, SLOW, SOLVED, Trial
from benchmarks.reports.tables import milliseconds, origin, share, table
from benchmarks.rivals.evolution import POINTS
from benchmarks.suites.conflicts import LESS, Relaxed


def band_section(rides: Sequence[Ride], command: str) -> str:
    """Bands of speeds."""
    rows = [
        (
            r.name,
            r.solution.status,
            f"{r.solution.abscissa:.9f}",
            share(round(r.feasible * r.solution.starts.tried), r.solution.starts.tried),
            milliseconds([r.single]),
            milliseconds([r.per_start]),
            f"{r.excess:.0e}",
            f"{'yes' if r.proved else 'no'}, {r.pieces} pieces",
            ("yes" if r.stable else "no"),
            r.own or "–",
        )
        for r in rides
    ]
    header = (
        "box", "status", "abscissa", "starts feasible", "median start", "solve / starts",
        f"excess at {CHECKED} speeds", "proved between them", "stable in all of it", "own proof",
    )  # fmt: skip
    note = (
        f"Six free parameters, Fr from 1.2 to 2.4 in 7 scenarios, the worst abscissa is minimised; {STARTS} "
        "starts (each "
        "sign of the tilt apart), none spared. A start's time is that of its own run of IPOPT; solve / starts has "
        "everything in it: speeds that are added, polishing, rechecking. The proof is by Liénard and Chipart's "
        "conditions "
        f"on p(s + γ + {MARGIN:.0e}), polynomials in Fr whose Bernstein coefficients are enclosed in ball arithmetic."
    )
    return "\n\n".join(["## Bands of speeds", origin(command), table(header, rows), note]) + "\n"


def variety_section(trials: Sequence[Trial], command: str) -> str:
    """Varied problems and the failures by cause."""
    good = [t for t in trials if not t.cause]
    rows = [
        ("problems", len(trials)),
        ("with scenarios", sum(bool(t.problem.scenarios) for t in trials)),
        ("with tolerances", sum(bool(t.problem.tolerances) for t in trials)),
        ("in SI", sum(t.problem.parameter_set.name == "SI" for t in trials)),
        ("somebody found a feasible design", sum(t.solvable for t in trials)),
        ("of these, stable at the best known", sum(t.solvable and _stable(t) for t in trials)),
        ("**solved at default settings**", f"**{share(len(good), len(trials))}**"),
        ("of these, infeasible and nobody found otherwise", sum(not t.solvable for t in good)),
        ("median time of a solve", milliseconds(t.default.seconds for t in trials)),
        ("90 % of times below", milliseconds((t.default.seconds for t in trials), 0.9)),
        (f"longer than {SLOW:.0f} s", ", ".join(str(t.index) for t in trials if t.slow) or "none"),
    ]
    note = (
        "A problem is solved when the default solve ends `optimal`, an independent judge (eigenvalues, up to "
        "1025 points "
        f"per band, corners and inside of the tolerance box) finds its design feasible within {FEASIBLE:.0e} "
        "and its value "
        f"as claimed, and the best known value is within {SOLVED:.0e}; or when it ends `infeasible` and nobody found a "
        f"feasible design. The others: differential evolution on eigenvalues ({POINTS} points per band), a "
        "solve from its "
        f"end, and {REFERENCE_STARTS} starts of another seed, all tried. Where eigenvalues scatter beside a "
        "multiple root, "
        "what 2e-15 of the coefficients does to them is granted."
    )
    return (
        "\n\n".join(
            [
                "## Varied design problems",
                origin(command),
                table(("", ""), rows),
                note,
                "### Objectives",
                _objectives(trials),
                "### Failures by cause",
                _failures(trials),
            ]
        )
        + "\n"
    )


def conflict_section(checks: Sequence[Relaxed], command: str) -> str:
    """Relaxations of infeasible problems."""
    kinds = list(dict.fromkeys(c.conflict.kind for c in checks))
    rows = []
    for kind in kinds:
        group = [c for c in checks if c.conflict.kind == kind]
        rows.append(
            (
                kind,
                len(group),
                sum(c.status == "infeasible" for c in group),
                sum(c.enough for c in group),
                sum(c.needed for c in group),
                milliseconds(c.seconds for c in group),
            )
        )
    good = sum(c.enough and c.needed for c in checks)
    header = (
        "conflict",
        "problems",
        "said infeasible",
        "relaxation is enough",
        f"{LESS:.0%} of it is not",
        "median time",
    )
    failed = [(k, c.conflict.kind, c.cause, dict(c.amounts)) for k, c in enumerate(checks) if c.cause]
    failures = table(("problem", "conflict", "cause", "relaxation"), failed) if failed else "None."
    note = (
        "Each is infeasible by a closed form. A relaxation is enough when the reported design meets all moved "
        "limits by "
        "the independent judge; it is needed when with 1 % less the solve says infeasible and two differential "
        "evolutions "
        "on the violation find no feasible design either."
    )
    return (
        "\n\n".join(
            [
                "## Conflicts",
                origin(command),
                f"**{share(good, len(checks))}** as they should be.",
                table(header, rows),
                note,
                "### Failures",
                failures,
            ]
        )
        + "\n"
    )


def _stable(trial: Trial) -> bool:
    return trial.default.status == "optimal" and trial.default.abscissa < 0


def _objectives(trials: Sequence[Trial]) -> str:
    asked = Counter(_asked(t) for t in trials)
    failed = Counter(_asked(t) for t in trials if t.cause)
    return table(("objective", "problems", "failed"), ((n, k, failed[n]) for n, k in sorted(asked.items())))


def _asked(trial: Trial) -> str:
    assert trial.problem.objective is not None
    return f"{trial.problem.sense} {trial.problem.objective.text}".replace("**", "^")


def _failures(trials: Iterable[Trial]) -> str:
    rows = [
        (
            t.index,
            len(t.problem.free),
            ", ".join(
                n for n, given in (("scenarios", t.problem.scenarios), ("tolerances", t.problem.tolerances)) if given
            ),
            _asked(t),
            t.cause,
            f"{t.default.value:.9g}",
            f"{t.best:.9g}",
            ", ".join(t.by),
        )
        for t in trials
        if t.cause
    ]
    header = ("problem", "free", "with", "objective", "cause", "value", "best known", "reached by")
    return table(header, sorted(rows, key=lambda row: str(row[4]))) if rows else "None."
