"""The additional microservices of an autopilot, besides those that are part of it."""

from autopilot_bridge.services.incoming import incoming_services
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.mission_services import mission_services
from autopilot_bridge.services.payload_commands import PayloadCommands
from autopilot_bridge.services.small_services import small_services
from autopilot_bridge.services.vehicle_files import vehicle_files


def microservices(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The microservices of one autopilot, in the order in which they get messages."""
    return (
        *mission_services(parts),
        *incoming_services(parts),
        *small_services(parts),
        *vehicle_files(parts),
        PayloadCommands(parts),
    )
