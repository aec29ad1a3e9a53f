"""Processing of magnetic surveys: compensation of the aircraft, and lines, levels and grids."""
