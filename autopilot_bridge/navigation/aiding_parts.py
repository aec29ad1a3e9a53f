"""What all that aids the filter works on."""

from dataclasses import dataclass

from autopilot_bridge.navigation.clocks import Clocks, Contradictions
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.standby import Standby
from flightsim.interface import SensorReadings


@dataclass(frozen=True, slots=True, kw_only=True)
class AidingParts:
    """One filter's parts, shared by the modules that aid it.

    Attributes:
        readings: newest samples of the sensors.
        solution: estimate and covariance.
        health: the filter's own state.
        clocks: when each sensor last aided.
        contradictions: how often the filter's belief had to give way.
        standby: what is held while nothing aids.
    """

    readings: SensorReadings
    solution: Solution
    health: NavigationHealth
    clocks: Clocks
    contradictions: Contradictions
    standby: Standby
