"""Roots and classes of many quartics, accurate for every kind of polynomial.

Roots are judged by the coefficients that they rebuild; classes against exact arithmetic and against `is_stable` and
`real_roots`, which have tests of their own, as `backward_error` has.
"""

from functools import partial
from math import comb

import numpy as np
import pytest
from helpers import curves
from helpers.designs import wide_designs
from helpers.oracles import routh_exact

from tmsopt import laws
from tmsopt.models import tms
from tmsopt.roots import (
    CLASSES,
    abscissa_and_damping,
    backward_error,
    exact_abscissa,
    is_stable,
    quartic_classes,
    quartic_factors,
    quartic_is_stable,
    real_roots,
)

JOINTLY_RIGHT = 1e-13
"""The promised accuracy of rebuilt coefficients."""

COUNT = 1000
DOUBT = [1.0, 0.3927315003875155, 5.90069031723172, -3.420867305216691e-159, 3.61127e-319]
"""Subnormal coefficients have few digits, and so have coefficients rebuilt from any roots."""


def drawn(rng, n, size):
    """Four roots each: two times a conjugate pair or two real ones, of either sign."""
    z = np.empty((n, 4), complex)
    for j in (0, 2):
        pair = rng.uniform(size=n) < 0.5
        first = size(n) * np.exp(1j * rng.uniform(0, np.pi, n))
        sign = rng.choice([-1, 1], (2, n))
        z[:, j] = np.where(pair, first, sign[0] * np.abs(first))
        z[:, j + 1] = np.where(pair, first.conj(), sign[1] * size(n))
    return z


def log(rng, low, high):
    return lambda n: 10 ** rng.uniform(low, high, n)


def polynomials(z):
    """Coefficients of ∏ (s − z): shape (n, 4) in, (n, 5) out."""
    return np.array([np.poly(row).real for row in z])


def perturbed(rng, a):
    """Coefficients off by relative 1e-16 … 1e-2: a k-fold root scatters by the k-th root of it."""
    return a * (1 + 10 ** rng.uniform(-16, -2, (len(a), 1)) * rng.uniform(-1, 1, a.shape))


def near_ep4(rng, n):
    spread = 10 ** rng.uniform(-16, -2, (n, 1))
    return polynomials(-(10 ** rng.uniform(-1, 1, (n, 1))) * (1 + spread * drawn(rng, n, log(rng, -1, 0))))


def ep4(rng, n):
    return (-(10 ** rng.uniform(-1, 1, (n, 1)))) ** np.arange(5) * np.array([comb(4, k) for k in range(5)])


def ep4_of_the_model(rng, n):
    """By the closed form for chi_H = 1; the coefficients are those of the model in double precision."""
    zeta_B, zeta_H = np.sort(-(10 ** rng.uniform(-1, 0.3, (2, n))), axis=0) * [[1.05], [1]]
    at = laws.ep4_chi_H_1(zeta_B, zeta_H)
    design = {"Fr": at.Fr, "mu": 0.1, "chi_B": at.chi_B, "chi_H": 1.0, "zeta_B": zeta_B, "zeta_H": zeta_H}
    return np.stack(np.broadcast_arrays(*tms.coefficients({**design, "lambda_s": at.lambda_s})), axis=-1)


def two_equal_factors(rng, n):
    z = drawn(rng, n, log(rng, -1, 1))
    z[:, 2:] = z[:, :2]
    return polynomials(z)


def triple(rng, n):
    z = drawn(rng, n, log(rng, -1, 1)).real
    return polynomials(np.stack([z[:, 0], z[:, 0], z[:, 0], z[:, 3]], axis=1))


def tiny(number):
    """Four roots, some 1e-300 … 1e-8 times the others, the whole range of doubles."""

    def make(rng, n):
        z = drawn(rng, n, log(rng, -0.5, 0.5))
        if number % 2:
            z = z.real
        z[:, :number] *= 10 ** rng.uniform(-300 / number, -8, (n, 1))
        return polynomials(z)

    return make


def ending_in_zeros(rng, n):
    a = rng.normal(size=(n, 5))
    a[np.arange(5) > rng.integers(0, 5, n)[:, None]] = 0
    return a


def with_holes(rng, n):
    a = rng.normal(size=(n, 5)) * (rng.uniform(size=(n, 5)) < 0.6)
    a[:, 0] = 1
    return a


def in_unit_of_time(unit, rng, n):
    return np.concatenate([rng.normal(size=(n // 2, 5)), near_ep4(rng, n - n // 2)]) * unit ** np.arange(5)


FAMILIES = {
    "normal": lambda rng, n: rng.normal(size=(n, 5)),
    "sizes over 16 decades": lambda rng, n: rng.normal(size=(n, 5)) * 10 ** rng.uniform(-8, 8, (n, 5)),
    "small integers": lambda rng, n: np.concatenate([np.ones((n, 1)), rng.integers(-3, 4, (n, 4))], axis=1),
    "two-mass-skate designs": lambda rng, n: np.stack(tms.coefficients(wide_designs(99, n)), axis=-1),
    "random roots": lambda rng, n: polynomials(drawn(rng, n, log(rng, -1, 1))),
    "roots up to 16 decades apart": lambda rng, n: polynomials(drawn(rng, n, log(rng, -8, 8))),
    "groups of roots 8 decades apart": lambda rng, n: polynomials(
        drawn(rng, n, lambda m: 10.0 ** rng.choice([-8, 0, 8], m) * rng.uniform(0.5, 2, m))
    ),
    "near EP4": near_ep4,
    "EP4": ep4,
    "EP4 with its coefficients perturbed": lambda rng, n: perturbed(rng, ep4(rng, n)),
    "EP4 of the model": ep4_of_the_model,
    "2EP2 and CEP2": two_equal_factors,
    "2EP2 and CEP2 perturbed": lambda rng, n: perturbed(rng, two_equal_factors(rng, n)),
    "EP3": triple,
    "EP3 perturbed": lambda rng, n: perturbed(rng, triple(rng, n)),
    **{f"tiny roots: {number}": tiny(number) for number in (1, 2, 3)},
    "roots at 0": ending_in_zeros,
    "coefficients of 0": with_holes,
    **{f"unit of time {u}": partial(in_unit_of_time, u) for u in (1e8, 1e-60)},
    "leading coefficient 1e-150": lambda rng, n: near_ep4(rng, n) * 1e-150,
}


def made(family, n=COUNT):
    return FAMILIES[family](np.random.default_rng(list(FAMILIES).index(family)), n)


# Roots


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_the_factors_give_the_coefficients_back(family):
    a = made(family)
    found = quartic_factors(*a.T)
    error = backward_error(a, found.roots)
    worst = int(np.argmax(error))
    assert error[worst] <= JOINTLY_RIGHT, f"{error[worst]} of {a[worst].tolist()}"


def test_abscissa_is_that_of_ball_arithmetic():
    """Roots at least a tenth of the largest apart move by less than (2/0.1)³ times the error of the coefficients."""
    rng = np.random.default_rng(5)
    z = drawn(rng, 4000, log(rng, -0.5, 0.5))
    apart = np.abs(z[:, :, None] - z[:, None, :]) + 10 * np.eye(4)
    a = polynomials(z[apart.min(axis=(1, 2)) > 0.1 * np.abs(z).max(axis=1)][:150])
    assert len(a) == 150
    found = abscissa_and_damping(*a.T)
    size = np.abs(a[:, 4]) ** 0.25
    expected = np.array([exact_abscissa(row.tolist()) for row in a])
    assert np.all(np.abs(found.abscissa - expected) <= 8000 * 1e-14 * 4 * size)
    assert np.median(np.abs(found.abscissa - expected) / size) < 1e-15


@pytest.mark.parametrize(
    ("factors", "abscissa", "ratio"),
    [
        ([[1, 0.4, 1], [1, 6, 9]], -0.2, 0.2),
        ([[1, -0.4, 1], [1, 6, 9]], 0.2, -0.2),
        ([[1, 0, 4], [1, 6, 9]], 0.0, 0.0),
        ([[1, 5, 6], [1, 1, -20]], 4.0, -1.0),
        ([[1, 5, 0], [1, 9, 0]], 0.0, 0.0),
        ([[1, 0, 0], [1, 0, 0]], 0.0, 0.0),
        ([[1, 0, 0], [1, -3, 0]], 3.0, -1.0),
        ([[1, -2e-200, 0], [1, 3, 2]], 2e-200, -1.0),
        ([[1, -2e200, 0], [1, 3, 2]], 2e200, -1.0),
    ],
)
def test_abscissa_and_damping_by_hand(factors, abscissa, ratio):
    found = abscissa_and_damping(*np.polymul(*factors))
    assert found.abscissa == pytest.approx(abscissa, rel=1e-14, abs=1e-320)
    assert found.damping_ratio == pytest.approx(ratio, rel=1e-14, abs=1e-320)


def test_options_of_earlier_versions_are_accepted():
    with pytest.warns(DeprecationWarning, match="compiled= is no longer needed"):
        assert quartic_is_stable(1, 4, 6, 4, 1, compiled=False)  # type: ignore[call-arg]


# Fallback, shapes and what has no roots


def test_eigenvalues_are_the_last_resort_and_are_counted():
    a = np.array([[1.0, 2.0, 3.0, 4.0, 5.0], DOUBT, DOUBT])
    assert quartic_factors(*a.T).fallbacks == 2
    found = abscissa_and_damping(*a.T)
    assert found.fallbacks == 2
    # two roots are those of s² + 0.39 s + 5.9, and the others are smaller than 1e-100
    assert found.abscissa[1] == pytest.approx(0, abs=1e-100)


def test_coefficients_sixty_decades_apart_come_back():
    rng = np.random.default_rng(0)
    a = rng.normal(size=(500, 5)) * 10.0 ** rng.uniform(-30, 30, (500, 5))
    found = quartic_factors(*a.T)
    assert found.fallbacks > 100
    assert backward_error(a, found.roots).max() <= JOINTLY_RIGHT


@pytest.mark.filterwarnings("error")
def test_a_root_beyond_all_doubles_is_infinite_without_a_warning():
    """5e-324 (s⁴ + …) − 1e308 s³ has a root at 2e631."""
    found = abscissa_and_damping(5e-324, -1e308, 1.0, 1.0, 1.0)
    assert found.abscissa == np.inf


def test_what_has_no_roots_is_nan_and_undefined():
    a = np.ones((12, 5))
    a[0, 0] = 0
    a[np.arange(1, 6), np.arange(5)] = np.nan
    a[np.arange(6, 11), np.arange(5)] = np.inf
    factors = quartic_factors(*a.T)
    motion = abscissa_and_damping(*a.T)
    none = np.arange(12) < 11
    for values in (factors.p[:, 0], factors.q[:, 1], motion.abscissa, motion.damping_ratio):
        assert np.array_equal(np.isnan(values), none)
    assert factors.fallbacks == motion.fallbacks == 0
    found = quartic_classes(*a.T)
    assert np.array_equal(found.kind == CLASSES.index("undefined"), none)
    assert not quartic_is_stable(*a.T).any()


def test_coefficients_broadcast():
    given = 1.0, 4.0, 6.0, np.linspace(1, 2, 3)[:, None], np.linspace(0.1, 0.2, 4)
    full = [np.broadcast_to(c, (3, 4)).copy() for c in given]
    assert np.array_equal(quartic_factors(*given).p, quartic_factors(*full).p)
    for coefficients, shape in ((given, (3, 4)), ((1, 4, 6, 4, 1), ()), ((1, 4, 6, 4, np.empty((0, 2))), (0, 2))):
        assert quartic_factors(*coefficients).p.shape == (*shape, 2)
        assert abscissa_and_damping(*coefficients).abscissa.shape == shape
        assert quartic_classes(*coefficients).kind.shape == quartic_is_stable(*coefficients).shape == shape
    with pytest.raises(ValueError, match="broadcast"):
        quartic_factors(1.0, np.ones(2), np.ones(3), 1.0, 1.0)


# Classes


def classes_by_definition(a):
    negative, positive = real_roots(a)
    zero = a[:, 4] == 0
    unstable = np.where((positive > 0) | zero, CLASSES.index("capsize"), CLASSES.index("weave"))
    damped = np.where(negative == 4, CLASSES.index("heavily damped"), CLASSES.index("stable"))
    with np.errstate(all="ignore"):  # what overflows is not stable to either
        return np.where(is_stable(a), damped, unstable), negative + positive + zero


def on_a_boundary(rng, n):
    """Weave, capsize and heavy damping within relative 1e-17 … 1e-9 of their boundaries."""
    c = rng.uniform(0.1, 3, (n, 4))
    one = np.ones(n)
    weave = [one, c[:, 0], c[:, 1] + c[:, 2], c[:, 0] * c[:, 2], c[:, 1] * c[:, 2]]  # (s² + c2)(s² + c0 s + c1)
    capsize = [one, c[:, 0] + 2, c[:, 1] + 2 * c[:, 0], 2 * c[:, 1], 0 * one]  # s (s + 2)(s² + c0 s + c1)
    a = np.concatenate([np.stack(weave, axis=1), np.stack(capsize, axis=1)])
    return a + 10 ** rng.uniform(-17, -9, (2 * n, 1)) * rng.uniform(-1, 1, (2 * n, 5)) * [0, 1, 1, 1, 1]


def test_classes_are_those_of_the_definitions():
    """On 3e4 designs, and near boundaries and exceptional points, where rounding or exact arithmetic decides."""
    rng = np.random.default_rng(3)
    few = [made(f, 20) for f in FAMILIES]  # exact arithmetic takes a tenth of a second for 200 of them
    designs = np.stack(tms.coefficients(wide_designs(7, 30_000)), axis=-1)
    a = np.concatenate([designs, -designs[:5000], on_a_boundary(rng, 500), made("normal", 5000), *few])
    found = quartic_classes(*a.T)
    kind, count = classes_by_definition(a)
    assert np.array_equal(found.kind, kind)
    assert np.array_equal(found.real_roots, count)
    assert np.array_equal(quartic_is_stable(*a.T), found.kind >= CLASSES.index("stable"))
    assert min(np.bincount(found.kind, minlength=5)[1:]) > 50  # each class is there
    assert 0 < found.doubtful < 2000


def test_classes_are_those_of_exact_arithmetic():
    """Away from the boundary of stability, where the Routh table in doubles is right."""
    a = np.stack(tms.coefficients(wide_designs(8, 60_000)), axis=-1)
    found = quartic_classes(*a.T)
    assert found.doubtful < 10
    for code in range(1, 5):
        for k in np.flatnonzero(found.kind == code)[:60]:
            negative, zero, positive = curves.sturm(a[k].tolist())
            assert found.real_roots[k] == negative + zero + positive
            assert routh_exact(a[k].tolist()) == (code >= 3)
            assert {1: positive + zero > 0, 2: positive + zero == 0, 3: negative < 4, 4: negative == 4}[code]


def test_real_roots_beside_a_double_one_are_counted_exactly():
    """A double real root or double pair whose coefficients are off by about an ulp, too little for doubles to decide."""
    rng = np.random.default_rng(8)
    r, b, c = rng.uniform(0.2, 2.0, (3, 200))
    double = np.array([np.polymul([1, 2 * x, x * x], [1, y, z]) for x, y, z in zip(r, b, c, strict=True)])
    twice = np.array([np.polymul([1, y, z], [1, y, z]) for y, z in zip(b, c, strict=True)])
    a = np.concatenate([double, twice, np.array([np.poly([-x] * 4) for x in r])])
    a = a * (1 + rng.integers(-2, 3, a.shape) * np.finfo(float).eps)
    found = quartic_classes(*a.T)
    assert found.real_roots.tolist() == [sum(curves.sturm(row.tolist())) for row in a]
    assert found.doubtful > len(a) / 3


def test_the_verdict_is_that_of_an_exact_routh_table():
    """As many stable designs as unstable ones."""
    a = np.stack(tms.coefficients(wide_designs(0, 50_000)), axis=-1)
    for verdict in (is_stable(a), quartic_is_stable(*a.T)):
        chosen = [*np.flatnonzero(verdict)[:500], *np.flatnonzero(~verdict)[:500]]
        assert [routh_exact(a[k]) for k in chosen] == [True] * 500 + [False] * 500
