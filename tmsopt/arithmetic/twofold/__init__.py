"""Arrays of numbers with twice the digits of a double, each with a bound on its error.

In: doubles. Out: `Twofold`, of which `nearest` tells the double that is nearest to the true value, where that is
certain. What balls do for one number, at a thousandth of the time for many.
"""

from tmsopt.arithmetic.twofold.numbers import Twofold, of_balls, twofold

__all__ = ["Twofold", "of_balls", "twofold"]
