"""Arrays of numbers with bounds of their rounding errors: a sign is certain where the number exceeds its bound."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.records import Array

_UNIT = 2 * np.finfo(float).eps
"""Bound of the rounding of one operation, relative to its result; the double of it pays for that of the bounds."""


@dataclass(frozen=True)
class Bounded:
    """Numbers with bounds of their errors, which every operation carries on."""

    value: Array
    error: Array

    def __getitem__(self, index: Any) -> "Bounded":
        return Bounded(self.value[index], self.error[index])

    def __sub__(self, other: "Bounded") -> "Bounded":
        return rounded(self.value - other.value, self.error + other.error)

    def __mul__(self, other: "Bounded") -> "Bounded":
        own, others = np.abs(self.value), np.abs(other.value)
        return rounded(self.value * other.value, own * other.error + (others + other.error) * self.error)

    def __truediv__(self, other: "Bounded") -> "Bounded":
        quotient = self.value / other.value
        room = np.abs(other.value) - other.error
        error = (self.error + np.abs(quotient) * other.error) / np.where(room > 0, room, np.nan)
        return rounded(quotient, np.where(room > 0, error, np.inf))


def rounded(value: Array, error: Array) -> Bounded:
    """A result whose last operation was rounded."""
    return Bounded(value, error + _UNIT * np.abs(value))


def beside(parts: Sequence[Bounded]) -> Bounded:
    """Columns side by side."""
    return Bounded(np.concatenate([p.value for p in parts], 1), np.concatenate([p.error for p in parts], 1))
