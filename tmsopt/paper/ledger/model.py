"""Section 2.1: the model, its parameters and its characteristic polynomial."""

import flint

from tmsopt.models import matrices, tms
from tmsopt.models.exact import Tilt
from tmsopt.paper.ledger import printed
from tmsopt.paper.ledger.algebra import depends, polynomials, q, ring
from tmsopt.paper.ledger.entry import Claim, Outcome, proof, section, universal
from tmsopt.paper.ledger.printed import laws
from tmsopt.roots.polynomial import quadratic_pencil

_claim = section("2.1 The TMS bicycle model; the characteristic polynomial")

_NAMES = "Fr mu chi_B chi_H zeta_B zeta_H T"

# powers of mass, length and time in each parameter, in the order of the text; g last
_DIMENSIONS = {
    "w": (0, 1, 0), "v": (0, 1, -1), "lambda_s": (0, 0, 0), "m_B": (1, 0, 0), "x_B": (0, 1, 0), "z_B": (0, 1, 0),
    "m_H": (1, 0, 0), "x_H": (0, 1, 0), "z_H": (0, 1, 0), "g": (0, 1, -2),
}  # fmt: skip


@_claim(
    "parameters-9", "text", "the model depends on 9 dimensional parameters",
    "derivatives of the characteristic polynomial in SI with respect to every parameter of the model",
)  # fmt: skip
def _nine() -> Outcome:
    names = [name for name in tms.sets[1].names if name != "g"]
    w, v, g, T, m_B, x_B, z_B, m_H, x_H, z_H = variables = ring("w v g T m_B x_B z_B m_H x_H z_H")
    # Fr stands squared or beside a1 and a3; Fr² in place of Fr shows the same dependence without a root
    a = laws.copo(v**2 / (g * w), m_H / m_B, x_B / w, x_H / w, z_B / w, z_H / w, Tilt(T))
    matters = [any(depends(c, str(x.over)) for c in a) for x in variables]
    count = sum(matters) - 1  # without g
    return proof(
        count == 9 == len(names),
        "The polynomial depends on all of them, and on the acceleration g of gravity as a tenth.",
        "The polynomial depends on another number of parameters.", "9", str(count),
    )  # fmt: skip


@_claim(
    "parameters-7", "text", "7 dimensionless parameters",
    "exact rank of the matrix of dimensions (mass, length, time) of the 9 parameters and g",
)  # fmt: skip
def _seven() -> Outcome:
    matrix = flint.fmpz_mat([list(powers) for powers in _DIMENSIONS.values()])
    groups = matrix.nrows() - matrix.rank()
    without = flint.fmpz_mat([list(p) for name, p in _DIMENSIONS.items() if name != "g"])
    return proof(
        groups == 7,
        f"Ten parameters, g included, less three dimensions; the nine of the text without g leave "
        f"{without.nrows() - without.rank()}, with no Froude number among them.",
        printed="7",
        computed=str(groups),
    )


@_claim(
    "nu_H", "text after Eq. matrices",
    "ν_H = (χ_H − 1) cos λ_s − ζ_H sin λ_s is the distance u_H of mass H from the steer axis, over w",
    "squared distance of the point (χ_H, ζ_H) from the line through (1, 0) along (sin λ_s, cos λ_s), as a polynomial "
    "identity modulo sin² + cos² = 1",
)  # fmt: skip
def _distance() -> Outcome:
    chi_H, zeta_H, sine, cosine = polynomials("chi_H zeta_H sine cosine")
    across, down = chi_H - 1, zeta_H
    along = across * sine + down * cosine
    squared = (across**2 + down**2) * (sine**2 + cosine**2) - along**2
    return proof(squared == printed.nu_H(chi_H, zeta_H, sine, cosine) ** 2)


@_claim(
    "forces", "text", "the model has dissipative, gyroscopic, potential and circulatory forces",
    "symmetric and antisymmetric parts of V and P, exactly",
)  # fmt: skip
def _forces() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, cosine = polynomials(f"{_NAMES} cosine")
    _, V, P = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T * cosine, cosine)
    parts = [X[0][1] + sign * X[1][0] for X in (V, P) for sign in (1, -1)]
    circulatory = parts[3]
    determinant = 4 * V[0][0] * V[1][1] - parts[0] ** 2
    return proof(
        all(part != 0 for part in parts)
        and circulatory.subs({"Fr": 0}) == 0
        and determinant == -(V[0][1] ** 2),
        "The symmetric part of V has the determinant −V12²/4: its damping is indefinite. The circulatory part is "
        "proportional to Fr².",
    )  # fmt: skip


def _coefficient(order: int) -> Claim:
    @_claim(
        f"copo-a{order}", "Eq. copo", f"a{order} of the characteristic polynomial",
        "determinant of M s² + V s + P from the printed matrices, as an identity of polynomials: it must be "
        "μ ν_H cos λ_s times the printed coefficient",
    )  # fmt: skip
    def check() -> Outcome:
        Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, cosine = ring(f"{_NAMES} cosine")
        M, V, P = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T * cosine, cosine)
        factor = mu * cosine * printed.nu_H(chi_H, zeta_H, T * cosine, cosine)
        claimed = laws.copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T))[order]
        return proof(
            quadratic_pencil(M, V, P)[order] == factor * claimed,
            otherwise="The coefficient of the determinant is another.",
        )

    return check


a0, a1, a2, a3, a4 = (_coefficient(order) for order in range(5))


@_claim(
    "copo-scale", "Eq. chapo", "p(s) with these coefficients is the characteristic polynomial",
    "the quotient of the determinant and p, and the determinant of a bicycle with ν_H = 0",
)  # fmt: skip
def _scale() -> Outcome:
    Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = ring(_NAMES)
    M, V, P = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T, T * 0 + 1)
    nu = printed.nu_H(chi_H, zeta_H, T, T * 0 + 1)
    a = laws.copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, Tilt(T))
    under = all(d == mu * nu * c for d, c in zip(quadratic_pencil(M, V, P), a, strict=True))
    design = (q(1), q(1), q(2), q(1), q(-2), q(-1))  # Fr, mu, chi_B, chi_H, zeta_B, zeta_H
    upright = quadratic_pencil(*matrices(*design, q(0), q(1)))
    cubic = list(laws.copo(*design, Tilt(q(0))))
    return universal(
        "up to the factor μ ν_H cos λ_s, which must not be 0",
        under,
        "Fr = 1, μ = 1, χ_B = 2, χ_H = 1, ζ_B = −2, ζ_H = −1, λ_s = 0 has ν_H = 0: the determinant vanishes for every "
        f"s, while p(s) = {_text(cubic)}",
        all(c == 0 for c in upright) and any(c != 0 for c in cubic),
    )


def _text(coefficients: list[object]) -> str:
    """A polynomial in s as text."""
    n = len(coefficients) - 1
    powers = {0: "", 1: " s"}
    terms = [f"{c}{powers.get(n - k, f' s^{n - k}')}" for k, c in enumerate(coefficients) if c != 0]
    return " + ".join(terms).replace("+ -", "− ") or "0"


CLAIMS = (_nine, _seven, _distance, _forces, a0, a1, a2, a3, a4, _scale)
