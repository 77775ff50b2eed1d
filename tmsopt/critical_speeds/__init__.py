"""Speeds: every weave, capsize and meeting speed of a design, exactly; growth rates over speed.

In: a design, and a parameter that varies. Out: `Speeds`, roots of polynomials of which none is missed, and `Growth`
to draw. Open `speeds` first.
"""

from tmsopt.critical_speeds.crossings import crossings
from tmsopt.critical_speeds.growth import growth
from tmsopt.critical_speeds.parametric import interpolated
from tmsopt.critical_speeds.speeds import Speeds, speeds

__all__ = ["Speeds", "crossings", "growth", "interpolated", "speeds"]
