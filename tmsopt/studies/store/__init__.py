"""The store of a study: one SQLite file, and what can be made of it."""
