"""MAVLink wire and links (ground floor), and the emulated autopilot with its SITL runner (upper floor)."""
