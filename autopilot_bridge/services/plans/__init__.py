"""The MAVLink mission protocol: missions, geofences and rally points."""
