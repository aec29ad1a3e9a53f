"""The command line `flightstack`: options, texts and exit codes."""
