"""Control laws of a fixed wing: setpoint and navigation state in, surfaces and throttle out."""

from autopilot_bridge.control.fixed_wing.controller import FixedWingController
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters

__all__ = ["FixedWingController", "FixedWingParameters"]
