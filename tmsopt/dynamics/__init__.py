"""A design in motion: every speed at which its motion changes, growth rates over speed, what it does after a push.

In: a design, and a parameter that varies or what sets the design moving. Out: `Speeds` and `Growth`, none missed,
and a `Simulation`. Open `speeds` first, then `simulate`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
