"""ArduPilot 4.6.3 (docs/firmware/ardupilot.md): what both classes of vehicle share."""
