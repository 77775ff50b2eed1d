"""Trace, domain, swallowtail: EP sets as curves with events."""
