"""Design problems as data, their formulations, and their solution by IPOPT."""
