"""What is PX4's and what is ArduPilot's: mode numbers, parameters, policies, texts, identity."""
