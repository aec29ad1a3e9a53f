"""What clients and devices send to the autopilot: setpoints, sticks, positions, targets, obstacles."""
