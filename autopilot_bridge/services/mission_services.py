"""The services for missions and fences of a firmware, besides the mission protocol."""

from autopilot_bridge.services.geofence import ArdupilotGeofence
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.mission_equipment import MissionEquipment
from autopilot_bridge.services.old_points import OldPoints


def mission_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The services of one autopilot."""
    equipment = MissionEquipment(parts)
    if parts.flavour.name == "px4":
        return (equipment,)
    return equipment, ArdupilotGeofence.of(parts), OldPoints.of(parts)
