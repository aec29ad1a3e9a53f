"""Mission files of ground stations: QGroundControl's `.plan` and `QGC WPL 110`."""
