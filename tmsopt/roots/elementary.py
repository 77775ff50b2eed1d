"""tan and sqrt of whatever number a formula is given: floats, arrays, CasADi expressions, balls."""

from typing import Any

import numpy as np


def tan(x: Any) -> Any:
    """Tangent of x (radians)."""
    return x.tan() if hasattr(x, "tan") else np.tan(x)


def sqrt(x: Any) -> Any:
    """Square root of x; nan, without a warning, for a negative float."""
    if hasattr(x, "sqrt"):
        return x.sqrt()
    with np.errstate(invalid="ignore"):
        return np.sqrt(x)
