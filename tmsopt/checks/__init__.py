"""What a design is, from its parameters alone: recheck, worst case, bounds without search, laws."""
