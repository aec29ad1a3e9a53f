"""Real firmware as the autopilot of a SITL: PX4 and ArduPilot as processes in lockstep with our world."""

from autopilot_bridge.firmware_process.backend import firmware_backend
from autopilot_bridge.firmware_process.build import FirmwareBuild
from autopilot_bridge.firmware_process.errors import FirmwareError

__all__ = ["FirmwareBuild", "FirmwareError", "firmware_backend"]
