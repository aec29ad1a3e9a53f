"""The missions, the interface to a vehicle that they use, reports and the command line."""
