"""The MAVLink parameter protocol, and parameters that persist."""
