"""Motion of ψ′ = −i H ψ against the exponential of H itself, shapes by hand."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

import tmsopt
from tmsopt.models import from_hamiltonian, from_matrices

DIMER = from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]])
"""Two modes that lose; of g2 = −g1 PT symmetric. EP2 at d = 0, k = |g1 − g2|/2, with ω = −i (g1 + g2)/2."""


def dimer(**values):
    return tmsopt.Problem(DIMER, fixed={"d": 0.0, "g1": 1.0, "g2": 0.2, "k": 0.4} | values)


def ring(a, loss, b):
    H = [["a - 1j*loss", "b"], [0, "a - 1j*loss"]]
    return tmsopt.Problem(from_hamiltonian(H), fixed={"a": a, "loss": loss, "b": b})


def waves(motion, size):
    """ψ at each time, shape (points, size)."""
    return np.array([np.add(motion[f"psi{k}_re"], 1j * np.asarray(motion[f"psi{k}_im"])) for k in range(1, size + 1)]).T


def omegas(motion):
    return [m.eigenfrequency for m in motion.modes]


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_exponential_of_h(seed):
    """Of any H, also far from 0 and not symmetric; x is a real parameter in it."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 5
    H = rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n)) + 10 * rng.normal() * np.eye(n)
    rows = H.tolist()
    rows[0][0] = f"x + 1j*({float(H[0, 0].imag)!r})"
    start = rng.normal(size=n) + 1j * rng.normal(size=n)
    asked = {
        f"psi{k + 1}_{part}": float(getattr(z, p))
        for k, z in enumerate(start)
        for part, p in (("re", "real"), ("im", "imag"))
    }
    problem = tmsopt.Problem(from_hamiltonian(rows), fixed={"x": float(H[0, 0].real)})
    motion = tmsopt.simulate(problem, start=asked, seconds=2.0, points=41)
    expected = np.array([expm(-1j * H * t) @ start for t in motion["t"]])
    assert waves(motion, n) == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
    assert motion.stable == bool(np.linalg.eigvals(H).imag.max() < 0)
    assert omegas(motion) == pytest.approx(sorted(np.linalg.eigvals(H), key=lambda z: -z.imag), abs=1e-9)
    for mode, omega in zip(motion.modes, omegas(motion), strict=True):  # its shape is an eigenvector
        psi = np.array(
            [
                a * np.exp(1j * math.radians(p)) if a else 0.0
                for a, p in zip(mode.amplitudes.values(), mode.phases.values(), strict=True)
            ]
        )
        assert psi @ (H.T - omega * np.eye(n)) == pytest.approx(np.zeros(n), abs=1e-8)


def test_the_first_mode_begins_at_1_where_nothing_is_asked():
    """At the EP2 ψ = e^(−iωt) (1 − i N t) (1, 0), N = [[−0.4i, 0.4], [0.4, 0.4i]]."""
    motion = tmsopt.simulate(dimer())
    t = np.asarray(motion["t"])
    expected = np.exp(-0.6 * t) * np.array([1 - 0.4 * t, -0.4j * t])
    assert waves(motion, 2) == pytest.approx(expected.T, abs=1e-13)
    assert list(motion.names) == ["t", "psi1_re", "psi1_im", "psi2_re", "psi2_im"]
    assert (motion.stable, motion.structure) == (True, "EP2")
    peak = next(m for m in motion.measures if m.name == "psi2_im")  # t e^(−0.6 t) at t = 1/0.6
    assert peak.peak == pytest.approx(-0.4 / 0.6 / math.e, rel=1e-10)


@pytest.mark.parametrize(
    ("problem", "omega", "amplitudes", "phases"),
    [
        (dimer(), -0.6j, [1, 1], [0, 90]),  # (H − ω) (1, i) = 0
        (dimer(g1=-1.0, g2=1.0, k=1.0), 0, [1, 1], [0, -90]),  # gain in the first: (1, −i)
        (ring(2.0, 0.5, 0.7), 2 - 0.5j, [1, 0], [0, math.nan]),
        (ring(-3.0, 0.5, -0.7), -3 - 0.5j, [1, 0], [0, math.nan]),
    ],
)
def test_all_modes_merge_in_one_shape(problem, omega, amplitudes, phases):
    motion = tmsopt.simulate(problem)
    (mode,) = motion.modes
    assert mode.eigenfrequency == pytest.approx(omega, abs=1e-12)
    assert (mode.multiplicity, mode.geometric, mode.partial) == (2, 1, (2,))
    assert list(mode.amplitudes.values()) == pytest.approx(amplitudes, abs=1e-9)
    assert list(mode.phases.values()) == pytest.approx(phases, abs=1e-6, nan_ok=True)
    assert "EP2: two modes merge in one shape" in str(motion)
    assert "t e^(-i omega t)" in str(motion)
    assert "CEP" not in str(motion)
    told = motion.to_json()["modes"][0]["eigenfrequency"]
    assert complex(told["re"], told["im"]) == mode.eigenfrequency


@pytest.mark.parametrize("frequency", [0.0, 5.0, -5.0])
def test_on_the_real_axis_an_exceptional_point_grows(frequency):
    """PT symmetric, H² = 0 but for the frequency: |ψ₂| = k t."""
    H = [["w + 1j*g", "k"], ["k", "w - 1j*g"]]
    motion = tmsopt.simulate(tmsopt.Problem(from_hamiltonian(H), fixed={"w": frequency, "g": 0.3, "k": 0.3}))
    assert np.abs(waves(motion, 2)[:, 1]) == pytest.approx(0.3 * np.asarray(motion["t"]), abs=1e-10)
    assert not motion.stable
    assert "not stable: modes merge on the real axis, so the motion grows as t;" in str(motion)
    assert all(math.isnan(m.settling) for m in motion.measures)
    assert 1 < motion["t"][-1] < 1e3


def test_below_the_point_nothing_dies_out():
    """k > g: ω = ±√(k² − g²), real."""
    motion = tmsopt.simulate(dimer(g1=-0.6, g2=0.6, k=1.0))
    assert sorted(z.real for z in omegas(motion)) == pytest.approx([-0.8, 0.8], abs=1e-12)
    assert not motion.stable
    assert "an eigenfrequency is real, and its motion neither grows nor dies out" in str(motion)
    assert "decays too slowly" not in str(motion)


def test_beyond_the_point_one_mode_grows():
    """g > k: ω = ±i √(g² − k²)."""
    motion = tmsopt.simulate(dimer(g1=-1.0, g2=1.0, k=0.6))
    assert "not stable: the motion does not settle" in str(motion)
    assert motion["t"][-1] == pytest.approx(3 / 0.8, rel=0.1)  # grown e³-fold


@pytest.mark.parametrize("word", ["lean", "push", "noise"])
def test_h_has_no_handlebar(word):
    with pytest.raises(tmsopt.InputError, match="psi2_im=1"):
        tmsopt.simulate(dimer(), **{word: 1.0})  # type: ignore[arg-type]


def test_a_real_double_pair_on_the_axis_grows_too():
    """q″ = −q twice, coupled one way: (s² + 1)² with one chain, rounding of its real part aside."""
    pair = from_matrices(M=[[1, 0], [0, 1]], K=[[1, "b"], [0, 1]])
    motion = tmsopt.simulate(tmsopt.Problem(pair, fixed={"b": 0.5}))
    assert motion.structure == "CEP2"
    assert "not stable: modes merge on the imaginary axis, so the motion grows as t;" in str(motion)
