"""The additional microservices of an autopilot, besides those that are part of it."""

from autopilot_bridge.services.equipment.payload_commands import PayloadCommands
from autopilot_bridge.services.files.vehicle_files import vehicle_files
from autopilot_bridge.services.inputs.incoming import incoming_services
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.plans.plan_services import mission_services
from autopilot_bridge.services.vehicle_services import small_services


def microservices(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The microservices of one autopilot, in the order in which they get messages."""
    return (
        *mission_services(parts),
        *incoming_services(parts),
        *small_services(parts),
        *vehicle_files(parts),
        PayloadCommands(parts),
    )
