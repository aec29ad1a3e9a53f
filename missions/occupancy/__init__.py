"""Search with a shared occupancy map (seed 003, section IV): cells, decisions, detections, the mission."""
