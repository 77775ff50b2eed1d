"""Trace: sets of exceptional points as curves with events, domains of stability, the swallowtail.

In: a problem whose pattern leaves one freedom. Out: `Trace` with `Branch`es, `Domain`, `Swallowtail`. Open `trace`
first; `continuation` follows one curve, `seeds` finds where to begin, `events` locates what happens on it, `steering`
lets a user follow one by hand.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
