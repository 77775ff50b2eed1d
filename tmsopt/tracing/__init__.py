"""Traces sets of exceptional points as curves with events; domains of stability; the swallowtail.

A pattern must leave one degree of freedom. `trace` finds every curve of it in the box as a `Branch`; `continuation`
follows one curve, `seeds` finds points on new curves, `events` locates what happens on them, and `steering` lets a user
follow a curve point by point.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
