"""Control laws of a multicopter: setpoint and navigation state in, motor commands out."""

from autopilot_bridge.control.controller import MulticopterController
from autopilot_bridge.control.parameters import MulticopterParameters

__all__ = ["MulticopterController", "MulticopterParameters"]
