"""Benchmarks: honest numbers, failures kept."""
