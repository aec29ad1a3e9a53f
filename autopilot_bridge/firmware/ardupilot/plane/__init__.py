"""ArduPlane."""
