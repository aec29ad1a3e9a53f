"""What a vehicle takes in by messages besides commands: odometry, targets, obstacles."""

from autopilot_bridge.services.external_odometry import ExternalOdometryService
from autopilot_bridge.services.microservice import AutopilotParts, Microservice


def incoming_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """Those of one autopilot; a simulated world gets to know it."""
    if parts.simulation is not None:
        parts.simulation.attend(parts)
    return (ExternalOdometryService(parts),)
