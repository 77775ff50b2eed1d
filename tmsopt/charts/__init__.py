"""Chart: grids of designs in memory or in a folder."""
