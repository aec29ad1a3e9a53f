"""PX4 on a fixed wing."""
