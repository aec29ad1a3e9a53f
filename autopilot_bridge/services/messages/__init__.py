"""The messages that an autopilot streams, and what both firmwares have in common of them."""
