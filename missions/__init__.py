"""What a mission may ask of a vehicle, the missions themselves, reports and the command line."""
