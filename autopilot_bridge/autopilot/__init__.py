"""The emulated autopilot: sensor readings and MAVLink frames in, motor commands and messages out. Sans-IO."""

from autopilot_bridge.autopilot.autopilot import Autopilot
from autopilot_bridge.autopilot.channels import AutopilotChannel

__all__ = ["Autopilot", "AutopilotChannel"]
