"""What all packages may import and what knows nothing of the world: compiler, checks, rotations, geodesy."""
