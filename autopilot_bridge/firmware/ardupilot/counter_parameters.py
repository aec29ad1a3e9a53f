"""The counter parameters of ArduPilot: stored mission items (MIS_TOTAL), boots (STAT_BOOTCNT)."""

from typing import Final

from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

MISSION_ITEMS: Final = "MIS_TOTAL"
BOOTS: Final = "STAT_BOOTCNT"


class Counters(Microservice):
    """Updates the counters; a change is announced and stored like that of any other parameter.

    Args:
        parts: the autopilot's parameters and plans.
    """

    coarse_timers = True

    def __init__(self, parts: AutopilotParts) -> None:
        self._parameters = parts.parameters
        self._mission = parts.stores[MissionType.MISSION]
        self._booted = False

    def tick(self, time_us: int) -> None:
        """Count the boot once; update the count of the stored mission items."""
        parameters = self._parameters
        if not self._booted:
            self._booted = True
            parameters.set(BOOTS, parameters.get(BOOTS) + 1.0, check_range=False)
        items = float(len(self._mission.items))
        if parameters.get(MISSION_ITEMS) != items:
            parameters.set(MISSION_ITEMS, items, check_range=False)
