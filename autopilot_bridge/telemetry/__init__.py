"""The autopilot's telemetry: message builders per flavour and the streams that send them."""
