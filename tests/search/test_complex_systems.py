"""Exceptional points of complex matrices beside closed forms: located, proved, traced, counted, split."""

import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import tmsopt
from tmsopt.cli import command_group as main
from tmsopt.documents import list_events
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices

EXACT = 1e-12
"""What print and closed forms are met to: some hundred roundings."""

DIMER = from_hamiltonian([["w + d - 1j*g1", "k"], ["k", "w - 1j*g2"]])
"""Two lossy modes: ω = w + d/2 − i (g1 + g2)/2 ± (k² + (d − i (g1 − g2))²/4)^(1/2), an EP2 at d = 0, k = |g1 − g2|/2."""
LASER = from_hamiltonian([["d + 1j*g", "k"], ["k", "-1j*l"]])
"""(ω − d − i g)(ω + i l) = k²; a real ω asks for (ω − d) ω + g l = k² and ω (l − g) = d l."""
LOSSES = {"w": 0.0, "d": 0.0, "g1": 1.0, "g2": 0.2}


def dimer(free, fixed=LOSSES, **asked):
    fixed = {n: x for n, x in {**LOSSES, **fixed}.items() if n not in free}
    return tmsopt.Problem(DIMER, fixed=fixed, free=free, **(asked or {"locate": "EP2"}))


def laser(free, **fixed):
    return tmsopt.Problem(
        LASER, fixed={n: x for n, x in {"d": 0.0, **fixed}.items() if n not in free}, free=free, locate="weave"
    )


TWO = complex(1 + math.cos(math.pi - 2), -math.sin(2))
PUBLISHED = {
    "loss_only_dimer": ({"k": 0.4, "d": 0}, -0.6j, 2),
    "pt_dimer": ({"g": 1}, 0j, 2),
    "passive_dimer": ({"g": 2}, 5 - 1j, 2),
    "pt_trimer": ({"gain": math.sqrt(2), "loss": math.sqrt(2), "d1": 0, "d3": 0}, 0j, 3),
    "ep3_sensor": ({"gain": math.sqrt(2), "loss": math.sqrt(2), "d1": 0, "d3": 0}, 0j, 3),
    "ring_backscattering": ({"r": -math.cos(2), "s": math.sin(2)}, TWO, 2),
    "bose_hubbard": ({"e1": 0, "e2": 0, "e3": 0, "g1": 3, "g2": 1, "g3": -1}, 0j, 4),
}
"""Problem → parameters of its exceptional point, eigenfrequency and order; the sources are in the files."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n == "bose_hubbard")) for n in PUBLISHED])
def test_published_exceptional_points_are_located_and_proved(name):
    where, omega, order = PUBLISHED[name]
    found = tmsopt.solve(f"problems/{name}.toml")
    assert max(abs(found.parameters[n] - x) for n, x in where.items()) < EXACT
    assert (found.structure, found.status) == (f"EP{order}", "optimal")
    (root,), (frequency,) = found.roots, found.eigenfrequencies
    assert abs(complex(frequency.re, frequency.im) - omega) < EXACT
    assert complex(frequency.re, frequency.im) == 1j * complex(root.re, root.im)
    assert root.multiplicity == frequency.multiplicity == order
    proof = tmsopt.prove(found)
    assert (proof.proved, proof.pattern) == (True, f"EP{order}")
    assert [z.multiplicity for z in proof.eigenfrequencies] == [order]
    (diagnosis,) = tmsopt.diagnose(found)
    assert (diagnosis.algebraic, diagnosis.geometric, diagnosis.kind) == (order, 1, "defective")


def test_a_ring_of_modes_has_its_point_at_the_closed_form():
    """g = (sqrt((b + c)² − 4 a²) − (b − c))/2 with ω = 0, by the constant term of the polynomial; others are simple."""
    found = tmsopt.solve("problems/ring_of_modes.toml")
    a, b, c = (found.parameters[n] for n in "abc")
    assert abs(found.parameters["g"] - (math.sqrt((b + c) ** 2 - 4 * a**2) - (b - c)) / 2) < EXACT
    (double,) = (root for root in found.eigenfrequencies if root.multiplicity == 2)
    assert abs(complex(double.re, double.im)) < EXACT
    assert (len(found.eigenfrequencies), found.conditions) == (3, {"real": 2, "by_symmetry": 1})
    assert tmsopt.prove(found).proved


@pytest.mark.parametrize(
    ("name", "exponent", "size"), [("loss_only_dimer", "1/2", math.sqrt(0.4)), ("ep3_sensor", "1/3", 1.0)]
)
def test_a_sensor_responds_by_the_root_of_its_order(name, exponent, size):
    """(k eps)^(1/2) of a dimer and (k² eps)^(1/3) of a trimer, by the characteristic equation to leading order."""
    (diagnosis,) = tmsopt.diagnose(f"problems/{name}.toml")
    (law,) = next(r for r in diagnosis.responses if r.parameter == "eps").laws
    assert (str(law.branches.exponent), law.branches.roots) == (exponent, diagnosis.algebraic)
    assert law.branches.prefactor == pytest.approx(size, rel=1e-9)


def test_the_curve_of_a_dimer_is_half_the_difference_of_losses():
    traced = tmsopt.trace(dimer({"g2": (0.1, 3.0), "d": (-1.0, 1.0), "k": (0.01, 2.0)}))
    assert traced.pattern == "EP2"
    assert set(np.unique(np.concatenate([b.kinds for b in traced.branches]))) == {"EP2"}
    assert len(traced.branches) == 2  # g2 < g1 and g2 > g1; between them k = 0
    for branch in traced.branches:
        at = branch.parameters
        assert np.abs(at["k"] - np.abs(1 - at["g2"]) / 2).max() < EXACT
        assert np.abs(at["d"]).max() < EXACT
        assert np.allclose(branch.abscissa, -(1 + at["g2"]) / 2, rtol=0, atol=EXACT)
        row = next(iter(branch.records()))
        assert (row["omega_re"], row["omega_im"]) == pytest.approx((0, -(1 + row["g2"]) / 2), abs=EXACT)
        assert "c" not in row


@pytest.mark.slow
@pytest.mark.parametrize("far", [0.0, 1000.0])
def test_all_real_eigenfrequencies_and_all_triple_ones(far):
    """Im ω = 0 where g l = k² of a lossy and an amplified mode; three meet at g² = 2 in a chain, whatever its carrier."""
    dimer = from_hamiltonian([[f"{far} + 1j*g", 1], [1, f"{far} - 2j"]])
    every = tmsopt.solve_all(tmsopt.Problem(dimer, free={"g": (0.1, 1.5)}, locate="weave"))
    assert every.complete
    assert [s.parameters["g"] for s in every.solutions] == [pytest.approx(0.5, abs=1e-9)]
    rows = [[f"{far} + d + 1j*g", 1, 0], [1, far, 1], [0, 1, f"{far} + e - 1j*l"]]
    free = {"d": (-1, 1), "e": (-1, 1), "g": (0.5, 2.0), "l": (0.5, 2.0)}
    every = tmsopt.solve_all(tmsopt.Problem(from_hamiltonian(rows), free=free, locate="EP3"))
    assert every.complete
    assert [s.parameters["g"] for s in every.solutions] == [pytest.approx(math.sqrt(2), abs=1e-9)]
    assert every.solutions[0].structure == "EP3"


def test_meetings_along_a_parameter_are_those_of_the_matrix():
    """±a pass each other at no k: only k = 0.4 is a meeting, and none is a root 0."""
    found = tmsopt.speeds(dimer({"k": (0.01, 2)}, locate=None), parameter="k").found
    assert [(c.kind, c.root.multiplicity) for c in found] == [("EP2", 2)]
    assert found[0].at == pytest.approx(0.4, abs=1e-14)
    assert (found[0].root.re, found[0].root.im) == pytest.approx((-0.6, 0.0), abs=1e-14)


def test_the_threshold_of_a_pt_dimer():
    """Gain g and loss g, coupled by k: balanced up to g = k; with more loss l the threshold is g = l or g l = k²."""
    found = tmsopt.solve(laser({"g": (0.1, 1.5)}, k=1.0, l=2.0))
    assert found.parameters["g"] == pytest.approx(0.5, abs=EXACT)
    assert max(z.im for z in found.eigenfrequencies) == pytest.approx(0, abs=EXACT)
    margins = tmsopt.robustness(
        replace(found.problem, fixed={**found.parameters, "g": 0.25}, free={}), weights={"g": 1.0}
    )
    assert (margins.limit.kind, margins.capsize.found) == ("weave", False)
    assert margins.radius == pytest.approx(0.25, abs=1e-9)


def test_heavy_damping_of_the_polynomial_is_no_boundary():
    assert not tmsopt.nearest(tmsopt.solve("problems/ring_backscattering.toml"), "heavy damping").found


def test_the_optimum_of_a_lossy_dimer_is_its_trace():
    """No eigenfrequency decays faster than the mean loss, which all reach beyond the exceptional point."""
    found = tmsopt.solve(dimer({"k": (0.1, 2)}, minimize="abscissa"))
    assert found.abscissa == pytest.approx(-0.6, abs=EXACT)
    assert (found.status, found.bound.proven) == ("optimal", True)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_the_optimum_where_nothing_is_stable_is_the_mean_gain(size):
    """No greatest gain is below the mean one, which symmetric chains reach; a search for EPs of full order leads on."""
    rows = [
        [
            "k" if abs(i - j) == 1 else f"1j*{size - i} + d" if i == j == 0 else f"1j*{size - i}" if i == j else "0"
            for j in range(size)
        ]
        for i in range(size)
    ]
    free = {"d": (-1.0, 1.0)} | ({"k": (0.1, 2.0)} if size > 1 else {})
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(rows), free=free, minimize="abscissa"))
    assert found.abscissa == pytest.approx((1 + size) / 2, abs=1e-9)


@pytest.mark.parametrize("command", ["solve --full", "prove", "describe"])
def test_no_words_of_the_double_are_shown(command):
    text = CliRunner().invoke(main, [*command.split(), "problems/pt_trimer.toml"]).output
    assert not [w for w in ("CEP", "pair", "damping", "heavily", "capsize", "divergence") if w in text]
    assert "eigenfrequenc" in text


def test_json_has_eigenfrequencies_beside_roots():
    found = tmsopt.solve("problems/loss_only_dimer.toml").to_json()
    (root,) = found["roots"]
    of_block = {"multiplicity": 2, "defective": True, "geometric_multiplicity": 1}  # an EP2: one eigenvector
    assert found["eigenfrequencies"] == [{"re": -root["im"], "im": root["re"], **of_block}]
    assert "eigenfrequencies" not in tmsopt.solve("problems/coupled_pair.toml").to_json()


def test_charts_take_a_complex_system():
    """Stable beside unstable where the gain passes the loss."""
    plane = laser({"g": (0.1, 1.5), "l": (0.1, 1.5)}, k=1.0)
    chart = tmsopt.chart(replace(plane, locate=None), ("g", "l"), points=(40, 40), boundaries=False)
    gain, loss = np.meshgrid(*chart.grid)
    names = np.array(tmsopt.roots.CLASSES)[np.asarray(chart.kind)]
    assert set(np.unique(names)) == {"stable", "weave"}
    off = np.minimum(np.abs(gain - loss), np.abs(gain * loss - 1)) > 1e-9
    assert np.array_equal((names == "stable")[off], ((gain < loss) & (gain * loss < 1))[off])


def test_the_threshold_is_the_edge_and_says_which_eigenfrequency_is_real():
    """ω = d l / (l − g) by the imaginary part of the characteristic equation; the other is the trace less this."""
    found = tmsopt.solve(laser({"g": (-1, 1.5)}, l=0.5, d=0.2, k=0.3))
    real = 0.2 * 0.5 / (0.5 - found.parameters["g"])
    assert found.stable is False
    assert found.beyond_axis == 0
    assert found.to_json()["stable"] is False
    assert found.notes == ()
    report = found.report()
    assert "marginally stable\n" in report
    assert f"neither loss nor gain; {real:.5g} is real" in report


def test_a_threshold_of_a_lossier_mode_is_not_the_edge():
    """The other eigenfrequency has the imaginary part of the trace, g − l."""
    found = tmsopt.solve(laser({"g": (0.11, 4)}, l=0.1, d=0.3, k=0.5))
    gain = found.parameters["g"] - 0.1
    assert gain > 0.01
    assert found.beyond_axis == pytest.approx(gain, abs=EXACT)
    assert found.notes == (f"not the edge of stability: another root has real part {gain:.2g}",)
    report = found.report()
    assert "one eigenfrequency has the most gain" in report
    assert "least damped" not in report


@pytest.mark.parametrize(("rest", "beyond"), [("s + 1", 0.0), ("s - 1", 1.0)])
def test_a_weave_of_a_real_system_says_whether_it_is_the_edge(rest, beyond):
    """(s² + c s + 1.3) times s ± 1, whose weave is c = 0."""
    r = 1 if rest == "s + 1" else -1
    model = from_coefficients([1, f"c + {r}", f"1.3 + {r}*c", f"1.3*{r}"])
    found = tmsopt.solve(tmsopt.Problem(model, free={"c": (-0.5, 0.7)}, locate="weave"))
    assert found.parameters["c"] == pytest.approx(0, abs=EXACT)
    assert found.stable is False
    assert found.beyond_axis == pytest.approx(beyond, abs=EXACT)
    assert found.notes == (("not the edge of stability: another root has real part 1",) if beyond else ())
    assert ("marginally stable\n" in found.report()) is not bool(beyond)


def test_a_parameter_at_zero_is_changed_absolutely_and_shifts_hold():
    """A detuning ε of an EP2 moves it by (k ε)^(1/2) beside ε/2, which is within 10 % up to some 1e-2; a common one by ε.

    The EP2 is at k = (g1 − g2)/2 = 0.6.
    """
    (found,) = tmsopt.diagnose(tmsopt.solve(dimer({"d": (-1, 1), "k": (0.05, 2)}, {"g1": 1.3, "g2": 0.1})))
    by = {r.parameter: r for r in found.responses}
    assert not by["d"].relative
    (law,) = by["d"].laws
    assert str(law.branches.exponent) == "1/2"
    assert law.branches.prefactor == pytest.approx(math.sqrt(0.6), rel=1e-9)
    (common,) = by["w"].laws
    assert str(common.branches.exponent) == "1"
    assert common.branches.prefactor == pytest.approx(1, rel=1e-9)
    assert (common.below, common.above) == (1, 1)  # it is exact
    text = found.report(full=True)
    assert "not move it" not in text
    assert "nowhere sampled" not in text


@pytest.mark.slow
def test_digits_of_a_curve_through_an_EP3_are_no_more_than_are_met():
    """The EP3 of the trimer at g = l = √2, d = 0: what is printed near it is right to half a unit of its last digit."""
    model = from_hamiltonian([["d + 1j*g", "k", "0"], ["k", "0", "k"], ["0", "k", "-1j*l"]])
    free = {"g": (0.1, 2.5), "l": (0.1, 2.5), "d": (-1.0, 1.0)}
    traced = tmsopt.trace(tmsopt.Problem(model, fixed={"k": 1.0}, free=free, locate="EP2"))
    near = [e for e in traced.events if abs(e.parameters["g"] - math.sqrt(2)) < 1e-3 and abs(e.parameters["d"]) < 1e-3]
    assert near
    for branch in traced.branches:
        for row in list_events(branch, {"g": tmsopt.problem.Unit()}, model)[1:]:
            value = float(str(row[1]))
            if abs(value - math.sqrt(2)) < 1e-3 and "g" in row[-1].split(", "):
                assert abs(value - math.sqrt(2)) <= 0.5 * 10.0 ** -len(str(row[1]).split(".")[1])


@pytest.mark.slow
def test_no_damping_ratio_is_told_of_the_cases_of_a_matrix():
    limits = {"constraints": {"c": "k <= 0.6"}, "tolerances": {"g1": 0.05, "k": 0.02}}
    asked = dimer({"g1": (0, 3), "d": (-1, 1), "k": (0.05, 1)}, {"g2": 0.1}, minimize="abscissa", **limits)
    report = str(tmsopt.solve(asked))
    assert "worst case" in report
    assert "damping ratio" not in report


# Crossings that keep their eigenvectors are no exceptional points


DIABOLIC = from_hamiltonian([["d", "k"], ["k", "-d"]])
"""Real symmetric: never defective."""
BOX = {"d": (-1.0, 1.0), "k": (-1.0, 1.0)}


def test_a_diabolic_point_is_not_found():
    found = tmsopt.solve(tmsopt.Problem(DIABOLIC, free=BOX, locate="EP2"), throw=False)
    data, report = found.to_json(), str(found)
    assert (found.status, data["defective"], data["geometric_multiplicity"]) == ("not_converged", False, 2)
    assert "none found" in report
    assert "diabolic point (semisimple), not an EP" in report
    assert found.parameters["d"] == pytest.approx(0, abs=1e-12)
    proof = tmsopt.prove(found)
    assert not proof.proved
    assert "not an EP" in proof.reason


def test_the_search_goes_on_for_a_defective_one():
    """A = [[d, k], [−k, −d]] is nilpotent where d² = k², and 0 at the middle of the box, to which it is nearest."""
    model = from_matrices(A=[["d", "k"], ["-k", "-d"]])
    found = tmsopt.solve(tmsopt.Problem(model, free=BOX, locate="EP2"))
    d, k = found.parameters["d"], found.parameters["k"]
    assert abs(d) == pytest.approx(abs(k))
    assert abs(d) > 0.01
    assert np.linalg.cond(np.linalg.eig([[d, k], [-k, -d]])[1]) > 1e7
    assert found.to_json()["geometric_multiplicity"] == 1


def test_all_designs_count_crossings_apart():
    every = tmsopt.solve_all(tmsopt.Problem(DIABOLIC, free=BOX, locate="EP2"), seconds=0, starts=8)
    assert not every.solutions
    assert every.coverage is not None
    assert every.coverage.crossings == every.coverage.starts
    assert "8 starts ended where a multiple eigenvalue has several eigenvectors" in str(every)


@pytest.mark.parametrize(("coupling", "proved"), [("0", False), ("1", True)])
def test_prove_counts_eigenvectors(coupling, proved):
    """Twice −0.7, with and without a Jordan chain, in fractions."""
    model = from_matrices(A=[["a", coupling], [0, "a"]])
    proof = tmsopt.prove(tmsopt.Problem(model, fixed={"a": -0.7}))
    assert (proof.proved, proof.geometric_multiplicity) == (proved, 1 if proved else 2)
    assert proof.defective.holds is proved


def test_prove_shows_a_minor_in_balls():
    """s⁴ + 3 s² + 2 + p²: flutter begins at p = 1/2, with one eigenvector."""
    model = from_matrices([[1, 0], [0, 1]], None, [[1, "p"], ["-p", 2]])
    proof = tmsopt.prove(tmsopt.Problem(model, free={"p": (0.1, 1.0)}, locate="CEP2"))
    assert proof.proved
    assert (proof.geometric_multiplicity, proof.defective.holds) == (1, True)


def test_blocks_of_two_are_no_ep4():
    """Two equal oscillators, critically damped: −1 four times, with two eigenvectors."""
    model = from_matrices([[1, 0], [0, 1]], [["c", 0], [0, "c"]], [[1, 0], [0, 1]])
    problem = tmsopt.Problem(model, free={"c": (0.1, 4.0)}, minimize="abscissa")
    found = tmsopt.solve(problem, throw=False)  # IPOPT's Jacobian is singular there: it may end unconverged
    assert found.parameters["c"] == pytest.approx(2, abs=1e-6)
    assert "not an EP" in str(found)


def test_coefficients_cannot_tell():
    swing = from_coefficients([1, "c", 1])
    found = tmsopt.solve(tmsopt.Problem(swing, free={"c": (0.0, 3.0)}, locate="EP2"))
    assert found.to_json()["defective"] is None
    assert "coefficients cannot tell" in str(found)


@pytest.mark.parametrize(
    ("table", "condition"),
    [
        ('A = [["x + 1j*y", 1], ["0.3j", "-1 - 0.5j"]]', lambda z: (z + 1 + 0.5j) ** 2 + 4 * 0.3j),
        ('M = [["1"]]\nD = [["x + 1j*y"]]\nK = [["2 + 1j"]]', lambda z: z**2 - 4 * (2 + 1j)),
        ('coefficients = ["1", "x + 1j*y", "2 + 1j"]', lambda z: z**2 - 4 * (2 + 1j)),
    ],
)
def test_complex_entries_in_a_file(tmp_path, table, condition):
    """A double eigenvalue by the discriminant of the quadratic polynomial."""
    path = tmp_path / "complex.toml"
    ranges = "x = { min = -4, max = 4 }\ny = { min = -4, max = 4 }"
    path.write_text(f'[model]\n{table}\n[parameters]\n{ranges}\n[objective]\nlocate = "EP2"\n')
    found = tmsopt.solve(path)
    assert abs(condition(complex(found.parameters["x"], found.parameters["y"]))) < EXACT
