"""The world: vehicles, air, sensors. Uses no MAVLink, no sockets and no wall clock."""
