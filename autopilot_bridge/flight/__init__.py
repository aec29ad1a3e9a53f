"""Flight tasks: each flies one kind of manoeuvre by writing the control setpoint. Flavour-neutral."""
