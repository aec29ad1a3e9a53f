"""The class of vehicle that a commander flies."""

from autopilot_bridge.commander import Commander
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters


def is_aircraft(commander: Commander) -> bool:
    """The vehicle is a fixed wing: its flight tasks use a fixed wing's parameters."""
    return isinstance(commander.context.parameters, FixedWingFlightParameters)
