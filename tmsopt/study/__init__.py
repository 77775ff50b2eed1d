"""Studies over designs: beside the laws, over speeds."""
