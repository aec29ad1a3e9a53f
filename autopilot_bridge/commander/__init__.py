"""Modes, arming, failsafes and home: who decides what the vehicle flies. Flavour-neutral, set up by a policy."""
