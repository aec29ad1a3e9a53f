"""What every mission has: its base class, its options, and the request of a run."""
