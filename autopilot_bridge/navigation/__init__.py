"""Navigation: where the vehicle is and how it moves, from its sensors."""

from autopilot_bridge.navigation.filter import NavigationFilter
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.parameters import NavigationParameters

__all__ = ["NavigationFilter", "NavigationHealth", "NavigationParameters"]
