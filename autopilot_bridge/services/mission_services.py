"""What belongs to missions and fences beside their protocol: those of a firmware."""

from autopilot_bridge.services.geofence import ArdupilotGeofence
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.mission_equipment import MissionEquipment


def mission_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """Those of one autopilot."""
    equipment = MissionEquipment(parts)
    return (equipment,) if parts.flavour.name == "px4" else (equipment, ArdupilotGeofence.of(parts))
