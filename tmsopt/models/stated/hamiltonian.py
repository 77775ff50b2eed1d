"""Models of psi' = -i H psi with a complex H."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tmsopt.errors import short
from tmsopt.models.model import Matrix, Model
from tmsopt.models.stated.equations import IMAGINARY
from tmsopt.models.stated.pairs import BESIDE, PAIRS, Pair, as_written, pair, real_text
from tmsopt.models.stated.texts import Texts, Unfit
from tmsopt.models.stated.user_defined import made, square

_UNIT_NAMES = ("i", "j")


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
    rows = square("H", H.tolist() if isinstance(H, np.ndarray) and H.ndim == 2 else H)
    derived = dict(quantities or {}) if isinstance(quantities or {}, Mapping) else {}
    texts = complex_texts(_unfit, {n: x for n, x in derived.items() if not isinstance(x, str)})
    texts.read_quantities({n: x for n, x in derived.items() if isinstance(x, str)})
    entries = [
        [_entry(texts, x, f"row {i}, column {j}") for j, x in enumerate(row, start=1)]
        for i, row in enumerate(rows, start=1)
    ]
    return from_pairs(entries, name, {n: texts.quantity(n) for n in derived} if derived else quantities)


def from_pairs(entries: list[list[Pair]], name: Any, quantities: Any) -> Model:
    """The same for entries that are pairs."""
    R: Matrix = [[x.re for x in row] for row in entries]
    J: Matrix = [[x.im for x in row] for row in entries]
    return made("hamiltonian", name, {"H": R, IMAGINARY: J}, quantities)


def complex_texts(fault: Any, known: Mapping[str, Any] | None = None) -> Texts:
    """A reader of texts with complex numbers; see `Texts`."""
    return Texts(lambda message, *key: fault(as_written(message), *key), known, PAIRS, BESIDE)


def text_entry(texts: Texts, text: str, where: str) -> Pair:
    """One entry as a pair; 0 for one with a fault."""
    known = set(texts.met)
    found = pair(texts.entry(real_text(text), "H", where))
    for taken in (n for n in _UNIT_NAMES if n in texts.met and n not in known):
        texts.fault(f"{where}: '{taken}' would be a parameter; write the imaginary unit as 1j", "H")
    return found


def _entry(texts: Texts, x: Any, where: str) -> Pair:
    if isinstance(x, str):
        return text_entry(texts, x, where)
    if isinstance(x, tuple):
        if len(x) != 2:
            raise Unfit("H", f"{where}: found {short(x)}; accepted: two, the real and the imaginary part")
        return Pair(*x)
    if isinstance(x, complex | np.complexfloating):
        return Pair(float(x.real), float(x.imag))
    return Pair(x)


def _unfit(message: str, key: str, *name: str) -> None:
    raise Unfit(key, ": ".join([*name, message]))
