"""Bounds on what any design of a box can reach."""
