"""What others tell a vehicle of what is around it: whom to follow, where to land, what is in the way."""

from autopilot_bridge.flight.landing_target import LandingTargetTrack
from autopilot_bridge.flight.obstacles import ObstacleMap
from autopilot_bridge.flight.target_motion import TargetMotion


class Surroundings:
    """Kept up to date by the services that hear of it, read by flight tasks.

    Attributes:
        leader: the target that is followed.
        landing_target: the place to land at.
        obstacles: distances around the vehicle.
    """

    __slots__ = ("landing_target", "leader", "obstacles")

    def __init__(self) -> None:
        self.leader = TargetMotion()
        self.landing_target = LandingTargetTrack()
        self.obstacles = ObstacleMap()
