"""Converts a pattern to something that a vehicle can fly: a trajectory in time, or waypoints."""

from missions.planning.natural import natural_trajectory
from missions.planning.trajectory import Trajectory, TrajectoryPoint, line_trajectory, plan_trajectory
from missions.planning.waypoints import leg_speeds, waypoints_along
from missions.vehicle.limits import MulticopterLimits

__all__ = [
    "MulticopterLimits",
    "Trajectory",
    "TrajectoryPoint",
    "leg_speeds",
    "line_trajectory",
    "natural_trajectory",
    "plan_trajectory",
    "waypoints_along",
]
