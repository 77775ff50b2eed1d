"""Proofs about one design in ball arithmetic: that its exceptional point exists, and that it is stable."""
