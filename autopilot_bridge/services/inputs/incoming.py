"""The services for received messages other than commands: odometry, fixes, targets, obstacles."""

from autopilot_bridge.services.inputs.external_odometry import ExternalOdometryService
from autopilot_bridge.services.inputs.follow import FollowService
from autopilot_bridge.services.inputs.gps_input import GpsInputService
from autopilot_bridge.services.inputs.landing_target import LandingTargetService
from autopilot_bridge.services.inputs.obstacles import ObstacleService
from autopilot_bridge.services.microservice import AutopilotParts, Microservice


def incoming_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The services of one autopilot; a simulated world is connected to the autopilot first."""
    if parts.simulation is not None:
        commander = parts.commander
        parts.simulation.attend(
            parts.parameters, lambda failed: commander.pilot.lose_signal(failed, commander.time_us)
        )
    return (
        ExternalOdometryService(parts),
        GpsInputService(parts),
        FollowService(parts),
        LandingTargetService(parts),
        ObstacleService(parts),
    )
