"""Tables and figures from finished data."""
