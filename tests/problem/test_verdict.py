"""One rule for each word: what is stable, marginally stable, growing, an exceptional point."""

import flint
import pytest
from helpers.texts import faults

import tmsopt
from tmsopt.chains import located_meetings
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices
from tmsopt.problem.verdict import MultipleRoot, describe_crossing, stability
from tmsopt.roots import exact_longest, exact_nullity, has_one_eigenvector


@pytest.mark.parametrize(
    ("ends", "edges", "verdict"),
    [
        ((-1.0, -0.9), (), "stable"),
        ((1.0, 1.1), (), "not stable"),
        ((-1e-9, 2e-9), (), "marginally stable"),  # rounding decides the sign
        ((5e-8, 1e-7), (), "marginally stable"),  # half of the numbers' own distance
        ((-1e-3, -4e-4), (), "stable"),  # beside a 4-fold root: as stored it is stable all the same
        ((0.0, 0.0), ("infinity",), "on the edge of stability"),
        ((float("nan"), 1.0), (), ""),
    ],
)
def test_one_verdict(ends, edges, verdict):
    assert stability(ends, edges, largest=1.0).verdict == verdict


def test_the_longest_chain_on_the_rightmost_line_grows():
    met = (MultipleRoot(0.0, 1.0, 2, 2, 1), MultipleRoot(0.0, -1.0, 4, 2, 3), MultipleRoot(-1.0, 0.0, 6, 1, 6))
    found = stability((0.0, 0.0), ("weave",), met, 1.0)
    assert (found.verdict, found.growth, found.on_edge) == ("growing", "t^2", True)


def test_what_is_no_exceptional_point_has_a_name():
    assert describe_crossing(MultipleRoot(0, 0, 2, 2, 1)) == "diabolic point (semisimple), not an EP"
    assert "not an EP4" in describe_crossing(MultipleRoot(0, 0, 4, 2, 2))
    assert MultipleRoot(0, 0, 2, None, 2).exceptional  # coefficients cannot tell
    assert MultipleRoot(0, 0, 2, None, 2).defective is None


AXIS = [
    (from_matrices([[1]], None, [["k"]]), {"k": 0.0}, "t"),  # a free particle
    (
        from_matrices([[1, 0], [0, 1]], [[0, "g"], ["-g", 0]], [[0, 0], [0, 0]]),
        {"g": 1.0},
        "",
    ),  # a charge drifts nowhere
    (from_matrices(A=[[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], ["z", 0, 0, 0]]), {"z": 0.0}, "t^3"),
    (from_matrices([[1, 0], [0, 1]], None, [[1, "c"], [0, 1]]), {"c": 1.0}, "t"),  # 1:1 resonance
    (from_matrices([[1, 0], [0, 1]], None, [["k", 0], [0, "k"]]), {"k": 4.0}, ""),
    (from_hamiltonian([["w", 1, 0], [0, "w", 1], [0, 0, "w"]]), {"w": -1.0}, "t^2"),
    (from_hamiltonian([["w", 0], [0, "w"]]), {"w": 2.5}, ""),
    (from_coefficients([1, 0, "2*w", 0, "w*w"]), {"w": 1.0}, "t"),  # of p(d/dt) y = 0
]


@pytest.mark.parametrize(("model", "fixed", "growth"), AXIS)
def test_a_defective_root_on_the_axis_grows(model, fixed, growth):
    """By the size of the largest Jordan block; every root is exactly on the axis, and nothing doubts it."""
    found = tmsopt.solve(tmsopt.Problem(model, fixed=fixed))
    data, report = found.to_json(), str(found)
    assert data["verdict"] == ("growing" if growth else "marginally stable")
    assert data.get("growth", "") == growth
    assert {r.get("growth", "") for r in data["roots"]} == {growth}
    assert "up to rounding errors" not in report
    assert ("neither" in report) is not bool(growth)
    assert (f"growing as {growth}" in repr(found)) is bool(growth)


GYROSCOPIC = from_matrices([[1, 0], [0, 1]], [[0, "g"], ["-g", 0]], [[-1, 0], [0, -1]])
"""s⁴ + (g² − 2) s² + 1: s² = −1 twice at g = 2, two pairs on the axis beyond, a root right of it below."""

ZIEGLER = from_matrices(M=[[3, 1], [1, 1]], K=[["2 - p", "p - 1"], [-1, 1]])
"""2 s⁴ + (7 − 2 p) s² + 1: a double pair at p = 7/2 − √2."""


def test_the_entry_of_a_root_on_the_axis_says_how_it_grows():
    """A Jordan block of two beside a lossy mode: rounding leaves 1e-17 of the real part, which is shown as 0."""
    model = from_hamiltonian([["1", "1", "0"], ["0", "1", "0"], ["0", "0", "-1j*g"]])
    data = tmsopt.solve(tmsopt.Problem(model, fixed={"g": 0.3})).to_json()
    assert [(r["multiplicity"], r.get("growth")) for r in data["roots"]] == [(2, "t"), (1, None)]
    assert [(r["multiplicity"], r.get("growth")) for r in data["eigenfrequencies"]] == [(2, "t"), (1, None)]


@pytest.mark.parametrize(
    ("model", "at", "growth", "exact"),
    [
        (GYROSCOPIC, {"g": 2.0}, "t", True),
        (GYROSCOPIC, {"g": 1.99999999999}, "t", False),
        (GYROSCOPIC, {"g": 2.5}, "", True),  # s² = −1/4 and −4
        (ZIEGLER, {"p": "7/2-sqrt(2)"}, "t", False),  # which fractions cannot show
        (from_matrices([[1, 0], [0, 1]], None, [[1, "c"], [0, 1]]), {"c": 1e-13}, "", False),  # grows, faintly
        (from_matrices([[1, 0], [0, 1]], None, [["k", 0], [0, "k"]]), {"k": "1/3"}, "", True),
    ],
)
def test_growth_is_hedged_unless_fractions_show_it(model, at, growth, exact):
    found = tmsopt.solve(tmsopt.Problem(model, fixed=at))
    data, report = found.to_json(), found.report(full=True)
    assert (found.stability.growth, found.edge_is_exact, data["verdict_is_exact"]) == (growth, exact, exact)
    for said in (repr(found), report):
        lines = [line for line in said.splitlines() if "growing as t" in line or "marginally" in line]
        assert lines
        assert all(
            ("up to" in line or line.endswith(",…)")) is not exact for line in lines
        )  # the short form may end there
    moved = [line for line in report.splitlines() if line.startswith("grows as t")]
    assert all(("up to rounding errors" in line) is not exact for line in moved)


@pytest.mark.parametrize(("k", "exact"), {"1/4": True, "1/4 + 1e-13": False, "sqrt(2)/4*sqrt(2)/2": False}.items())
def test_roots_meet_as_far_as_rounding_tells(k, exact):
    """s² + s + k is a square at k = 1/4."""
    found = tmsopt.solve(tmsopt.Problem(from_coefficients([1, 1, "k"]), fixed={"k": k}))
    assert found.structure == "EP2"
    assert found.multiple_as_rounded is not exact
    assert ("multiplicity_is_exact" in found.to_json()) is not exact
    assert ("up to rounding errors" in found.report(full=True)) is not exact


@pytest.mark.parametrize("sizes", [(1,), (3,), (2, 1), (2, 2), (3, 1), (1, 1, 1), (3, 2, 1)])
def test_the_longest_chain_in_fractions(sizes):
    """Blocks of Jordan at 1/3, seen through a change of basis."""
    n, q = sum(sizes), flint.fmpq
    ends = {sum(sizes[: k + 1]) - 1 for k in range(len(sizes))}
    J = flint.fmpq_mat(n, n, [q(1, 3) * (i == j) + (j == i + 1 and i not in ends) for i in range(n) for j in range(n)])
    P = flint.fmpq_mat(n, n, [q(1, i + j + 1) for i in range(n) for j in range(n)])
    A = (P * J * P.inv()).tolist()
    one = [[q(int(i == j)) for j in range(n)] for i in range(n)]
    pencil, factor = [one, [[-x for x in row] for row in A]], flint.fmpq_poly([q(-1, 3), q(1)])
    assert exact_longest(pencil, factor, n) == max(sizes)
    assert exact_nullity(pencil, factor) == len(sizes)


def judged(model, pattern, at):
    problem = tmsopt.Problem(model, free=dict.fromkeys(at, (-1.0, 1.0)), locate=pattern)
    assert problem.posed.pattern is not None
    met = located_meetings(problem.posed, problem.posed.pattern, problem.posed.ordered(at))[0]
    return met.geometric, met.longest


@pytest.mark.parametrize("off", [0.0, 1e-9, 3e-6])
def test_a_crossing_is_seen_from_as_far_as_coefficients_accept(off):
    """Real symmetric; the coefficients are those of an EP2 to off²."""
    assert judged(from_hamiltonian([["d", "k"], ["k", "-d"]]), "EP2", {"d": off, "k": -off}) == (2, 1)
    equal = from_matrices([[1, 0], [0, 1]], None, [["1 + x", "y"], ["y", "1 - x"]])
    assert judged(equal, "CEP2", {"x": off, "y": off}) == (2, 1)


def test_a_weak_coupling_still_makes_a_jordan_chain():
    assert judged(from_hamiltonian([["d + 1j*k", 1e-6], [0, 0]]), "EP2", {"d": 0.0, "k": 0.0}) == (1, 2)
    assert judged(from_matrices(A=[["a", 1, 0], [0, 0, 0], [0, 0, "b"]]), "EP3", {"a": 0.0, "b": 0.0}) == (2, 2)


def test_eigenvectors_are_counted_in_fractions_and_in_balls():
    """s² + 1 twice: apart, and with a coupling of its two oscillators."""
    q = flint.fmpq
    one, factor = [[q(1), q(0)], [q(0), q(1)]], flint.fmpq_poly([1, 0, 1])
    zero = [[q(0), q(0)], [q(0), q(0)]]
    coupled = [[q(1), q(1, 3)], [q(0), q(1)]]
    assert exact_nullity([one, zero, one], factor) == 2
    assert exact_nullity([one, zero, coupled], factor) == 1
    assert has_one_eigenvector([one, zero, coupled], flint.acb(0, 1))
    assert not has_one_eigenvector([one, zero, one], flint.acb(0, 1))


def test_no_design_on_the_edge_is_said_to_be_the_least_unstable():
    """ω = ±sqrt(k² − g²) are real for all g <= 1/2; at g = 1/2 alone the motion grows, and the abscissa is 0 everywhere."""
    system = from_hamiltonian([["1j*g", "k"], ["k", "-1j*g"]])
    problem = tmsopt.Problem(system, fixed={"k": 0.5}, free={"g": (0.1, 1.0)}, minimize="abscissa")
    design = tmsopt.solve(problem, throw=False)
    told = " ".join(design.report().split())
    assert design.abscissa == pytest.approx(0, abs=1e-12)
    assert "multiple roots decide" in told
    assert "least unstable" not in told
    assert "grows more slowly" not in told + " ".join(design.report(full=True).split())


def test_a_share_of_a_value_is_written_as_its_amount(tmp_path):
    """5 % of a mass of 5 kg is 0.25 kg; 0.05 would be 0.05 kg."""
    found = faults(tmp_path, 'model = "tms"\n[tolerances]\nm_B = "5 %"\n[parameters]\nm_B = "5 kg"\n')
    assert any("for 5 % of a value, write the amount" in fault for fault in found)
