"""Models of psi' = -i H psi with a complex H."""

from collections.abc import Mapping
from typing import Any

from tmsopt.models.model import Model
from tmsopt.models.stated.user_defined import made, square


def from_hamiltonian(H: Any, *, name: str = "stated", quantities: Mapping[str, Any] | None = None) -> Model:
    """A model of ψ′ = −i H ψ with a complex matrix H, told by its eigenfrequencies ω = i s.

    Everything is said of H: ``EP2`` is one of H, the ``abscissa`` is the greatest Im ω, gain less loss, and
    multiplicities are those of H. Inside, the polynomial is that of the real system of twice the size,
    A = [[J, R], [−R, J]] of H + Ω = R + i J, with a carrier Ω that a `Problem` chooses for its ranges.

    Args:
        H: square, up to 6 × 6, as nested lists or a NumPy array. An entry is a number, complex too, text as in a
            problem file such as ``"w - 1j*g"`` or ``"k*exp(1j*phi)"``, an SX, or a tuple of two SX, real and imaginary
            part. Names stand for real parameters.
        name, quantities: see `from_matrices`; quantities are real.

    Raises:
        Unfit: as `from_matrices`.

    Example:
        >>> dimer = tmsopt.models.from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]])  # two lossy modes
        >>> free = {"d": (-1, 1), "k": (0.1, 2)}
        >>> found = tmsopt.solve(tmsopt.Problem(dimer, fixed={"g1": 1.0, "g2": 0.2}, free=free, locate="EP2"))
        >>> found.structure, f"{found.parameters['k']:.6f}"  # an EP2 of H at |g1 - g2|/2
        ('EP2', '0.400000')

    More: docs/explanation/exceptional_points.md
    """
    return made("hamiltonian", name, {"H": square("H", H)}, quantities)
