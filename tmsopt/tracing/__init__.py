"""Traces curves of exceptional points with their events, boundaries of stability, and the swallowtail surface.

A pattern of roots must leave one degree of freedom. `trace` finds its curves in the box of the free parameters, each as
a `Branch`. `continuation` follows one curve, `seeds` finds points on new curves, and `events` locates special points on
the curves. `steering` lets a user follow a curve point by point.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
