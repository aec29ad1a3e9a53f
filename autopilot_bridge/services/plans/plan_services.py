"""The services for missions and fences of a firmware, besides the mission protocol."""

from autopilot_bridge.firmware.ardupilot.fence_and_rally_points import OldPoints
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.plans.equipment import MissionEquipment
from autopilot_bridge.services.plans.geofence import ArdupilotGeofence


def mission_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The services of one autopilot."""
    equipment = MissionEquipment(parts)
    if parts.flavour.name == "px4":
        return (equipment,)
    return equipment, ArdupilotGeofence.of(parts), OldPoints.of(parts)
