"""Viewers of a scene (`estimators.scene`): Rerun, live and as a file, and Foxglove."""
