"""How GPS is switched off in flight, for missions without it."""

from enum import StrEnum


class GpsOff(StrEnum):
    """The way in which GPS is switched off for the orbit."""

    AUTO = "auto"
    """By the command or, for a simulator that does not support it, by its parameter."""
    FAILURE = "failure"
    """By MAV_CMD_INJECT_FAILURE."""
    PARAMETER = "parameter"
    """By a parameter of the simulator, or of the filter that fuses GPS."""
