"""Monte Carlo studies: the papers' experiments that need no vehicle."""
