"""All solutions in a box by a search: those of closed forms, met and no other, and what it says about the rest."""

import json
import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from click.testing import CliRunner
from helpers.skates import skate

import tmsopt
from tmsopt.cli import command_group as main
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices
from tmsopt.search import estimate_coverage

c1, c2, x = (ca.SX.sym(n) for n in ("c1", "c2", "x"))


def oscillators(k, w, box=(-2, 2), **asked):
    """Two masses 1 with dampers c1, c2 and springs 1, w, coupled by k."""
    model = from_matrices([[1, 0], [0, 1]], [[c1, 0], [0, c2]], [[1 + k, -k], [-k, w + k]])
    return tmsopt.Problem(model=model, free={"c1": box, "c2": box}, **{"locate": "CEP2", **asked})


def all_of(problem, **options):
    """All solutions that a search finds, from no more starts than the least that settle it."""
    return tmsopt.solve_all(problem, **{"starts": 48, "seconds": 0, **options})


def meeting(k, w):
    """c1 and c2 of the CEP2 with a stable mean.

    (s² + c1 s + A)(s² + c2 s + B) − k² = (s² + bs + c)² with A = 1 + k, B = w + k needs b = (c1 + c2)/2,
    c² = AB − k², δ² = A + B − 2c for δ = (c1 − c2)/2, and bδ = A − B. The other one has −c1, −c2.
    """
    A, B = 1 + k, w + k
    c = math.sqrt(A * B - k * k)
    delta = math.sqrt(A + B - 2 * c)
    mean = (A - B) / delta
    return (mean + delta, mean - delta) if mean > 0 else (-mean - delta, -mean + delta)


@pytest.mark.slow
def test_both_cep2_of_two_oscillators():
    k, w = 0.3, 1.2
    one = np.array(meeting(k, w))
    b = one.sum() / 2
    found = all_of(oscillators(k, w, (-3, 3))).solutions
    designs = sorted([s.parameters["c1"], s.parameters["c2"]] for s in found)
    assert np.allclose(designs, sorted([one.tolist(), (-one).tolist()]), rtol=0, atol=1e-11)
    assert {s.structure for s in found} == {"CEP2"}
    assert sorted(s.abscissa for s in found) == pytest.approx(sorted([-b / 2, b / 2]), abs=1e-11)


@pytest.mark.slow
def test_a_box_with_one_of_them_or_none():
    stable = all_of(oscillators(0.3, 1.2, (0, 2)), starts=12)
    (design,) = stable.solutions
    assert [design.parameters[n] for n in ("c1", "c2")] == pytest.approx(meeting(0.3, 1.2), abs=1e-11)
    assert design.status == "optimal"
    none = all_of(oscillators(0.3, 1.2, (1.5, 2)), starts=16)
    assert none.solutions == ()
    assert none.coverage.hits == ()
    assert none.coverage.chance == pytest.approx(3 / none.coverage.starts)  # the rule of three


@pytest.mark.slow
def test_constraints_choose_among_them():
    chosen = all_of(oscillators(0.3, 1.2, constraints={"unstable": "c1 + c2 <= 0"}), starts=12).solutions
    assert [s.parameters["c1"] for s in chosen] == [pytest.approx(-meeting(0.3, 1.2)[0], abs=1e-11)]


@pytest.mark.slow
def test_two_solutions_close_to_each_other_are_not_told_to_more_digits_than_hold():
    """(s + 1)² + (y − 1/2) (y − 0.5000001): rounding of the 1 moves y by 1e-9, for the slope is 1e-7."""
    y = ca.SX.sym("y")
    model = from_coefficients([1, 2, 1 + (y - 0.5) * (y - 0.5000001)])
    found = tmsopt.solve_all(tmsopt.Problem(model, free={"y": (0, 1)}, locate="EP2"), seconds=0)
    for solution, errors, true in zip(found.solutions, found.errors, (0.5, 0.5000001), strict=True):
        assert abs(solution.parameters["y"] - true) <= errors["y"] < 1e-7


@pytest.mark.slow
def test_coverage_says_how_much_was_looked_at():
    """w (n − 1)/(n − w − 2) solutions expected for w found in n hits (Boender and Rinnooy Kan 1987)."""
    coverage, few = (tmsopt.solve_all(oscillators(0.3, 1.2), seconds=0, starts=n).coverage for n in (1024, 2))
    w, n = len(coverage.hits), sum(coverage.hits)
    assert w == 2
    assert min(coverage.hits) >= 3
    assert coverage.hits == tuple(sorted(coverage.hits, reverse=True))
    assert coverage.expected == pytest.approx(w * (n - 1) / (n - w - 2))
    assert 0 < coverage.chance <= 3 / coverage.starts
    assert few.starts == 2
    assert few.chance > coverage.chance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"locate": None, "minimize": "abscissa"}, "needs a pattern and no objective"),
        ({"minimize": "c1"}, "needs a pattern and no objective"),
        ({"locate": "EP2"}, "2 free parameters and 1 condition .*; free fewer"),
        ({"locate": "EP4"}, "2 free parameters and 3 conditions .*; free more"),
        ({"constraints": {"sum": "c1 + c2 == 1"}}, "isolated solutions; free more"),
        ({"tolerances": {"c1": 0.1}}, "isolated solutions"),
    ],
)
def test_problems_without_single_solutions_are_refused(asked, said):
    with pytest.raises(tmsopt.InputError, match=said):
        tmsopt.solve_all(oscillators(0.3, 1.2, **asked))


@pytest.mark.slow
def test_a_constraint_on_a_quantity_with_an_equation_of_its_own():
    """ω0 is an unknown beside those of the pattern; written by its formula, the bicycle is the same."""
    problem = tmsopt.load("problems/optimised_benchmark.toml")
    for asked in (problem, replace(problem, constraints={"decay": "a4 == a0"})):
        (design,) = all_of(asked, starts=4).solutions
        assert design.parameters["mu"] == pytest.approx(20.84626701, rel=1e-9)


@pytest.mark.slow
def test_of_the_command_line(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(
        """
[model]
M = [[1, 0], [0, 1]]
D = [["c1", 0], [0, "c2"]]
K = [["1 + k", "-k"], ["-k", "w + k"]]
[parameters]
c1 = { min = -2, max = 2 }
c2 = { min = -2, max = 2 }
k = 0.3
w = 1.2
[objective]
locate = "CEP2"
""",
        encoding="utf-8",
    )

    def answer(*words):
        result = CliRunner().invoke(main, ["solve", str(file), "--all", *words])
        assert result.exit_code == 0
        return result.stdout

    data, c1_of_one = json.loads(answer("--json")), abs(meeting(0.3, 1.2)[0])
    assert sorted(s["parameters"]["c1"] for s in data["solutions"]) == pytest.approx([-c1_of_one, c1_of_one], abs=1e-11)
    assert "locate CEP2: 2 solutions within the ranges, no other exists (proved; " in answer()
    assert data["completeness"]["complete"]
    assert (data["complete"], data["undecided"]) == (True, 0)
    assert [s["proved"] for s in data["solutions"]] == [True, True]
    assert data["coverage"] is None
    text = answer("--seconds", "0.001")
    assert "locate CEP2: 2 solutions within the ranges" in text
    assert "no proof that these are all: time limit reached" in text
    assert "undecided: c1 -2 … 2, c2 -2 … 2" in text
    assert "95 % confidence; no proof" in text
    data = json.loads(answer("--json", "--seconds", "0.001"))
    assert (data["complete"], data["undecided"]) == (False, len(data["completeness"]["undecided"]))
    assert data["undecided"] >= 1


@pytest.mark.slow
def test_a_continuum_of_solutions_is_told_from_none():
    """s⁴ + (Om² − 1 − k) s² + k: both pairs meet wherever Om = 1 + √k, a whole curve, for there is no damping."""
    free = {"Om": (0.5, 6.0), "k": (0.5, 3.0)}
    model = from_coefficients([1, 0, "Om**2 - 1 - k", 0, "k"])
    every = tmsopt.solve_all(tmsopt.Problem(model, free=free, locate="CEP2"), starts=8, seconds=0)
    assert not every.solutions
    assert every.coverage.singular > 0
    model = from_matrices([[1, 0], [0, 1]], [[0, "-Om"], ["Om", 0]], [[-1, 0], [0, "-k"]])
    with pytest.raises(tmsopt.InputError, match="1 by symmetry do not give isolated solutions; free fewer"):
        tmsopt.solve_all(tmsopt.Problem(model, free=free, locate="CEP2"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("free", "named"), [({"Fr": (0.5, 4.0)}, "EP2"), ({"Fr": (0.5, 4.0), "chi_B": (1.1, 2.0)}, "EP3")]
)
def test_the_pattern_that_is_suggested_has_as_many_conditions_as_there_are_free_parameters(free, named):
    """A k-fold root takes k − 1 conditions."""
    with pytest.raises(tmsopt.InputError, match=f"locate = '{named}'"):
        tmsopt.solve_all(skate(free, {"Fr": 2.0, "chi_B": 1.4, "lambda_s": 0.3}, minimize="abscissa"))


@pytest.mark.slow
def test_designs_at_a_parameter_that_is_zero():
    """H = [[10 + d − i, k], [k, 10 − d − 3i]]: 4 (d + i)² + 4 k² = 0 at d = 0 and k = ±1 alone, where ω = 10 − 2i."""
    dimer = from_matrices(
        A=[[-1, 0, "10 + d", "k"], [0, -3, "k", "10 - d"], ["-10 - d", "-k", -1, 0], ["-k", "-10 + d", 0, -3]]
    )
    problem = tmsopt.Problem(dimer, free={"d": (-5, 5), "k": (-5, 5)}, locate="CEP2")
    every = tmsopt.solve_all(problem)
    assert every.complete
    found = sorted((s.parameters["k"], s.parameters["d"]) for s in every.solutions)
    assert found == [(pytest.approx(-1, abs=1e-12), 0), (pytest.approx(1, abs=1e-12), 0)]
    for start in (0.0, 1e-15):  # as it is, and as a search leaves it
        near = replace(every.solutions[0], parameters={**every.solutions[0].parameters, "d": start})
        proof = tmsopt.prove(near)
        assert proof.proved, proof.reason
        assert float(proof.parameters["d"].value) == pytest.approx(0, abs=1e-50)


# The ends of a box, and how far a statement of coverage may be trusted


@pytest.mark.parametrize("seconds", [0, 60], ids=["search", "proof"])
@pytest.mark.parametrize("ends", [(-2.0, 2.0), (-2.0, 5.0), (-5.0, 2.0), (-1.999, 5.0), (-5.0, 1.999)])
def test_a_box_has_the_solutions_on_its_ends_and_none_beyond(ends, seconds):
    """s² + x s + 1 has double roots at x = ±2."""
    problem = tmsopt.Problem(from_coefficients([1, x, 1]), free={"x": ends}, locate="EP2")
    found = sorted(s.parameters["x"] for s in tmsopt.solve_all(problem, seconds=seconds).solutions)
    assert found == pytest.approx([at for at in (-2, 2) if ends[0] <= at <= ends[1]], abs=1e-12)


@pytest.mark.parametrize(
    "shares",
    [np.ones(20), np.ones(400), 0.8 ** np.arange(60), 1 / np.arange(1, 400) ** 1.5, np.array([1.0, 0.02, 0.02, 0.02])],
    ids=["20 alike", "400 alike", "each a fifth rarer", "a long tail", "three rare ones"],
)
def test_the_chance_of_another_solution_is_claimed_with_95_percent_confidence(shares):
    """Starts drawn at random, each led to one solution with a known chance: that of those not met is known too."""
    shares = shares / shares.sum()
    rng = np.random.default_rng(0)
    for starts in (50, 100, 200):
        drawn = rng.multinomial(starts, shares, size=2000)
        kept = sum(
            shares[row == 0].sum() <= estimate_coverage(starts, [int(h) for h in row if h], 0).chance for row in drawn
        )
        assert kept >= 0.95 * 2000


@pytest.mark.parametrize("rate", [1e-9, 1e12])
def test_all_EP2_of_a_dimer_in_any_unit(rate):
    """k = |g1 − g2|/2 and d = 0 alone: the discriminant (d − i (g1 − g2))² + 4 k² is 0 nowhere else with k > 0."""
    dimer = from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]])
    free = {"d": (-5 * rate, 5 * rate), "k": (rate / 10, 5 * rate)}
    every = tmsopt.solve_all(tmsopt.Problem(dimer, fixed={"g1": 3 * rate, "g2": rate}, free=free, locate="EP2"))
    assert every.complete
    assert [s.parameters["k"] / rate for s in every.solutions] == [pytest.approx(1, rel=1e-12)]


def test_double_zeros_of_the_discriminant_are_no_complete_list():
    """The eigenvalues z, 2 z and 1 meet at z = 0, 1/2 and 1, where the discriminant has double zeros: 3 points, degree 6."""
    H = [["x + 1j*y", 1, 0], [0, "2*(x + 1j*y)", 1], [0, 0, 1]]
    problem = tmsopt.Problem(from_hamiltonian(H), free={"x": (-3, 3), "y": (-3, 3)}, locate="EP2")
    assert not tmsopt.solve_all(problem, starts=4, seconds=1).complete


def test_a_mode_on_its_own_crosses_and_is_no_point():
    """±√(1 − g²) coincide at g = 1; one of them is 1/2 at g = √3/2, where the third mode keeps its own eigenvector."""
    H = [["1j*g", 1, 0], [1, "-1j*g", 0], [0, 0, 0.5]]
    every = tmsopt.solve_all(tmsopt.Problem(from_hamiltonian(H), free={"g": (0.1, 2.0)}, locate="EP2"))
    assert [s.parameters["g"] for s in every.solutions] == [1.0]
