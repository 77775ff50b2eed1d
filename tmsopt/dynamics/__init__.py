"""Dynamics of a design: critical speeds, growth rates over speed, and motion after a push.

Input: a design, and a parameter that varies or a disturbance. Output: `Speeds` and `Growth`, which miss no critical
speed, and a `Simulation`. Open `speeds` first, then `simulate`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
