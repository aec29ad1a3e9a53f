"""The world: vehicles, air, sensors. Knows no MAVLink, no sockets and no wall clock."""
