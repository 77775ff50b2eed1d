"""Section 2.3: the least spectral abscissa and the conditions for an EP4."""

from tmsopt.models import copo, matrices
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import printed
from tmsopt.paper.ledger.algebra import polynomials, positive, q, ring, substitute
from tmsopt.paper.ledger.entry import Claim, Outcome, proof, section, universal
from tmsopt.paper.ledger.lemmas import critical_square, general
from tmsopt.paper.ledger.printed import laws
from tmsopt.paper.ledger.stability import upright_case, wrongly_admitted
from tmsopt.roots.polynomial import product

_claim = section("2.3 Minimizing the spectral abscissa of general TMS bikes")

_NAMES = "Fr mu chi_B chi_H zeta_B zeta_H T"


def product_bound() -> bool:
    """(γ² + β1 γ + κ1)(γ² + β2 γ + κ2) exceeds γ⁴ by positive terms, each with some β or κ.

    A quartic with abscissa −γ is such a product in t = s + γ, so a4/a0 ≥ γ⁴, with equality only for (s + γ)⁴.
    """
    gamma, b1, b2, k1, k2 = polynomials("gamma b1 b2 k1 k2")
    excess = (gamma**2 + b1 * gamma + k1) * (gamma**2 + b2 * gamma + k2) - gamma**4
    return positive(excess) and substitute(excess, {"b1": 0, "b2": 0, "k1": 0, "k2": 0}) == 0


@_claim(
    "lscf-guarantee", "text", "lscf guarantees asymptotic stability at Fr > Fr_c",
    "certified roots of a second counterexample with χ_H = 1/2, far from 1",
)  # fmt: skip
def _guarantee() -> Outcome:
    design = tuple(q(x) for x in ("10", "1", "2", "0.5", "-1", "-0.9", "1"))
    square, a1 = critical_square(design), copo(*design)[1]
    return universal(
        "χ_H ≥ 1, or a1 > 0",
        upright_case(),
        f"Fr = 10, μ = 1, χ_B = 2, χ_H = 1/2, ζ_B = −1, ζ_H = −9/10, tan λ_s = 1 meets lscf (Fr_c² = {square}) and is "
        f"unstable, as a1 = {a1}",
        wrongly_admitted(design),
    )


@_claim(
    "a_min", "text, of FL1999", "the minimum of the spectral abscissa is a_min = ω0 = −(det P/det M)^(1/4)",
    "a polynomial identity for the product of the roots; the only polynomial that attains the bound; the benchmark "
    "geometry with rational tilt",
)  # fmt: skip
def _least() -> Outcome:
    T = q("0.1")
    a = copo(q(1), q("0.1"), q("1.2"), q("1.02"), q("-0.4"), q("-0.2"), T)
    ratio, square = (a[3] / a[1]) ** 2, a[4] / a[0]
    return universal(
        "as a lower bound, where det P/det M > 0; it is attained only by a design that has the EP4",
        product_bound(),
        "the benchmark geometry with tan λ_s = 1/10 cannot attain it at any speed: an EP4 needs (a3/a1)² = a4/a0, but "
        f"they are {ratio} and {square}, whatever Fr",
        ratio != square,
    )


@_claim(
    "w0", "Eq. w0", "ω0 of the TMS bicycle", "det P/det M of the printed matrices, as an identity of rational functions"
)
def _w0() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, cosine = ring(f"{_NAMES} cosine")
    M, _, P = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T * cosine, cosine)
    det_P, det_M = (X[0][0] * X[1][1] - X[0][1] * X[1][0] for X in (P, M))
    return proof(
        det_P / det_M == printed.w0(mu, chi_H, zeta_B, zeta_H, T),
        "Independent of Fr and χ_B. Real only where a4/a0 ≥ 0.", "det P/det M is another function.",
    )  # fmt: skip


@_claim(
    "w0-fourfold", "text after Eq. w0", "if ω0 is the minimum of the spectral abscissa, it is the 4-fold root",
    "equality in the bound for the product of the roots forces both quadratic factors to be (s − ω0)²",
)  # fmt: skip
def _fourfold() -> Outcome:
    return proof(product_bound(), "Among quartics with the same a4/a0 only (s − ω0)⁴ has the abscissa ω0.")


@_claim(
    "w0-Jordan", "text after Eq. w0", "the 4-fold root has a Jordan block of order 4",
    "rank of M s² + V s + P: identities that forbid its first column to vanish at any s",
)  # fmt: skip
def _jordan() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, s = ring(f"{_NAMES} s")
    one = T * 0 + 1
    M, V, P = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, one)
    nu = printed.nu_H(chi_H, zeta_H, T, one)
    first, second = (M[i][0] * s**2 + V[i][0] * s + P[i][0] for i in range(2))
    only = second == -mu * nu * (zeta_H * s**2 + 1)
    then = nu * first + zeta_H * second == nu * zeta_B * (zeta_B * s**2 + 1)
    apart = zeta_H * (zeta_B * s**2 + 1) - zeta_B * (zeta_H * s**2 + 1) == zeta_H - zeta_B
    level = copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_B, T)
    return proof(
        only and then and apart and level[1] == zeta_B * level[3],
        "The first column vanishes only if s² = −1/ζ_H = −1/ζ_B, so with ζ_B ≠ ζ_H every eigenvalue of the model has "
        "one Jordan block. With ζ_B = ζ_H there is no EP4, as a1 = ζ_B a3 gives a1 and a3 different signs.",
    )


@_claim("4poly-expansion", "Eq. 4poly", "expansion of (s − ω0)⁴", "product of four factors, as polynomials")
def _expansion() -> Outcome:
    (omega0,) = ring("omega0")
    return proof(product(*[[1, -omega0]] * 4) == list(laws.poly4(omega0)), otherwise="A coefficient differs.")


@_claim(
    "a1a3", "Eq. a1a3", "a1 = −4 ω0 a0 and a3 = −4 ω0³ a0",
    "coefficients of a0 times the product of four factors s − ω0",
)  # fmt: skip
def _a1a3() -> Outcome:
    omega0, a0 = ring("omega0 a0")
    m = product([a0], *[[1, -omega0]] * 4)
    return proof(m[1] == -4 * omega0 * a0 and m[3] == -4 * omega0**3 * a0)


@_claim(
    "a1a3-ratio", "equation after Eq. a1a3", "(ζ_B χ_H − ζ_H χ_B)/(χ_B − χ_H) = −1/ω0²",
    "a1/a3 from the determinant, set to the ratio of the coefficients of (s − ω0)⁴",
)  # fmt: skip
def _ratio() -> Outcome:
    a, (_, _, chi_B, chi_H, zeta_B, zeta_H, _) = general()
    return proof(
        a[1] / a[3] == -(zeta_B * chi_H - zeta_H * chi_B) / (chi_B - chi_H),
        "As a1/a3 = 1/ω0² at the EP4. There Fr ≠ 0 and χ_B ≠ χ_H, since a0 ω0 ≠ 0.",
    )


@_claim(
    "chib", "Eq. chib", "scaling law for χ_B at EP4",
    "the condition a3 = ω0² a1 solved for χ_B as a linear equation of rational functions",
)  # fmt: skip
def _chib() -> Outcome:
    omega0, mu, chi_B, chi_H, zeta_B, zeta_H, T = ring(_NAMES.replace("Fr", "omega0"))
    a = copo(1 + 0 * T, mu, chi_B, chi_H, zeta_B, zeta_H, T)
    none = copo(1 + 0 * T, mu, 0 * T, chi_H, zeta_B, zeta_H, T)
    constant = none[3] - omega0**2 * none[1]
    slope = (a[3] - omega0**2 * a[1] - constant) / chi_B
    return proof(
        -constant / slope == laws.chib(omega0, chi_H, zeta_B, zeta_H),
        "The only solution, as ω0² ζ_H − 1 < 0 for ζ_H ≤ 0.", "The linear equation has another solution.",
    )  # fmt: skip


@_claim("a2", "Eq. a2", "the condition a2 = 6 ω0² a0", "identity of polynomials: ζ_B times left less right side")
def _a2() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, omega0 = ring(f"{_NAMES} omega0")
    a = copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)
    law = laws.a2(Fr, mu, chi_H, zeta_B, zeta_H, Tilt(T), omega0)
    return proof(zeta_B * law == a[2] - 6 * omega0**2 * a[0], otherwise="The difference is not 0.")


CLAIMS: tuple[Claim, ...] = (
    _guarantee, _least, _w0, _fourfold, _jordan, _expansion, _a1a3, _ratio, _chib, _a2,
)  # fmt: skip
