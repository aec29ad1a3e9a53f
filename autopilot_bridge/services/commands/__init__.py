"""The MAVLink command protocol and the commands that both firmwares support."""
