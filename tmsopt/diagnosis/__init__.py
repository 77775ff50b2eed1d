"""Diagnose: Jordan chains, Puiseux splitting."""
