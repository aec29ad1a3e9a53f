"""Search for a magnetic target: the occupancy map, anomalies in readings, and their place."""
