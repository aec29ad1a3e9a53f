"""The error of a firmware's process."""

from autopilot_bridge.errors import BridgeError


class FirmwareError(BridgeError):
    """A firmware did not start, has ended, or does not answer; the message has its last lines of output."""
