"""Control laws of a multicopter: setpoint and navigation state in, motor commands out."""

from autopilot_bridge.control.multicopter.controller import MulticopterController
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters

__all__ = ["MulticopterController", "MulticopterParameters"]
