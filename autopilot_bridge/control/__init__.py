"""Control laws: setpoint and navigation state in, actuator commands out."""
