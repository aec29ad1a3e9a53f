"""Moved sticks end automatic flight (PX4 COM_RC_OVERRIDE)."""

from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.pilot import stick_travel
from autopilot_bridge.flight.context import ManualInput


class StickOverride:
    """Compares the sticks with their positions at the last mode command."""

    __slots__ = ("_at_command",)

    def __init__(self) -> None:
        self._at_command = ManualInput()

    def restart(self, sticks: ManualInput) -> None:
        """A mode was commanded, or the vehicle was armed, with these stick positions."""
        self._at_command = sticks

    def wanted(self, mode: FlightMode, sticks: ManualInput, parameters: CommanderParameters) -> bool:
        """True when the pilot takes over in flight."""
        if not sticks.valid:
            return False
        offboard = mode is FlightMode.OFFBOARD
        allowed = parameters.stick_override_offboard if offboard else parameters.stick_override
        if not allowed or mode in STICK_MODES:
            return False
        return stick_travel(sticks, self._at_command) > parameters.stick_override_threshold
