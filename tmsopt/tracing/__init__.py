"""Trace: sets of exceptional points as curves with events, domains of stability, the swallowtail.

In: a problem whose pattern leaves one freedom. Out: `Trace` with `Branch`es, `Domain`, `Swallowtail`. Open `trace`
first; `continuation` follows one curve, `seeds` finds where to begin, `events` names what happens on it.
"""

from tmsopt.tracing.branch import Branch, Event, Trace
from tmsopt.tracing.continuation import (
    End,
    between,
    both_ways,
    contains,
    crossing,
    curve,
    project,
    same,
    tangent_at,
    walk,
)
from tmsopt.tracing.domain import Domain, domain
from tmsopt.tracing.swallowtail import Swallowtail, swallowtail
from tmsopt.tracing.trace import trace

__all__ = [
    "Branch", "Domain", "End", "Event", "Swallowtail", "Trace", "between", "both_ways", "contains", "crossing",
    "curve", "domain", "project", "same", "swallowtail", "tangent_at", "trace", "walk",
]  # fmt: skip
