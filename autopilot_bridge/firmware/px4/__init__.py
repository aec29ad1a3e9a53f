"""PX4 v1.16.1 (docs/firmware/px4.md): what both classes of vehicle share."""
