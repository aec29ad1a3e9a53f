"""What other systems report of the surroundings: the target to follow, the landing target, obstacles."""

from autopilot_bridge.flight.landing_target import LandingTargetTrack
from autopilot_bridge.flight.obstacles import ObstacleMap
from autopilot_bridge.flight.target_motion import TargetMotion


class Surroundings:
    """Updated by the services that receive the messages, read by flight tasks.

    Attributes:
        leader: the target to follow.
        landing_target: the place to land at.
        obstacles: distances around the vehicle.
    """

    __slots__ = ("landing_target", "leader", "obstacles")

    def __init__(self) -> None:
        self.leader = TargetMotion()
        self.landing_target = LandingTargetTrack()
        self.obstacles = ObstacleMap()
