"""Studies: one question asked of many designs, with their store and engines."""
