"""Monte Carlo studies: experiments of the papers (docs/papers.md) that need no vehicle."""
