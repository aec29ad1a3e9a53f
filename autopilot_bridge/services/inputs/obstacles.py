"""OBSTACLE_DISTANCE and DISTANCE_SENSOR: obstacles around the vehicle, for avoidance.

Sources: MAVLink common.xml; PX4 1.16 accepts OBSTACLE_DISTANCE in BODY_FRD (or relative to north)
and horizontal DISTANCE_SENSORs; ArduPilot 4.6 accepts both, with PRX1_TYPE 2.
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from autopilot_bridge.dispatch import receives
from autopilot_bridge.flight.obstacles import SECTOR_RAD, SECTORS
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_AVOIDANCE: Final = int(dialect.FAILURE_UNIT_SYSTEM_AVOIDANCE)
_UNKNOWN_CM: Final = 65535
_SENSOR_WIDTH_RAD: Final = math.radians(30.0)
_HORIZONTAL: Final = range(dialect.MAV_SENSOR_ROTATION_NONE, dialect.MAV_SENSOR_ROTATION_YAW_315 + 1)


class ObstacleService(Microservice):
    """Keeps `surroundings.obstacles` up to date.

    Args:
        parts: of the autopilot.
        enabled: returns whether the firmware uses the messages, from its parameters.

    Attributes:
        refused: number of messages without usable content.
    """

    def __init__(self, parts: AutopilotParts, enabled: Callable[[ParameterStore], bool]) -> None:
        self._context = parts.commander.context
        self._parameters = parts.parameters
        self._simulation = parts.simulation
        self._system_id = parts.system_id
        self._enabled = enabled
        self.refused = 0

    @receives(dialect.MAVLink_obstacle_distance_message, dialect.MAVLink_distance_sensor_message)
    def _on_obstacles(
        self,
        message: dialect.MAVLink_obstacle_distance_message | dialect.MAVLink_distance_sensor_message,
        source: Source,
        time_us: int,
    ) -> None:
        """A DISTANCE_SENSOR of another vehicle is ignored."""
        if not self._enabled(self._parameters) or source.component_id == AUTOPILOT_COMPONENT:
            return
        if isinstance(message, dialect.MAVLink_obstacle_distance_message):
            taken = self._circle(message, time_us)
        else:
            taken = self._beam(message, time_us)
        self.refused += not taken

    def _circle(self, message: dialect.MAVLink_obstacle_distance_message, time_us: int) -> bool:
        """OBSTACLE_DISTANCE (330)."""
        frame = message.frame
        if frame not in (dialect.MAV_FRAME_GLOBAL, dialect.MAV_FRAME_LOCAL_NED, dialect.MAV_FRAME_BODY_FRD):
            return False
        step_rad = math.radians(abs(message.increment_f) or float(message.increment))
        if not math.radians(0.5) <= step_rad <= math.tau:
            return False
        if message.increment_f < 0.0:
            step_rad = -step_rad
        first_rad = math.radians(message.angle_offset) if abs(message.angle_offset) <= 720.0 else math.nan
        if math.isnan(first_rad):
            return False
        if frame != dialect.MAV_FRAME_BODY_FRD:
            first_rad -= float(self._context.nav[nav.EULER_RAD][2])
        values = np.array(message.distances, dtype=np.float64)[:SECTORS]
        known = values != _UNKNOWN_CM
        values *= 0.01
        if self._simulation is not None and not self._simulation.apply_failure(_AVOIDANCE, values):
            return True
        nearest_m, reach_m = message.min_distance * 0.01, message.max_distance * 0.01
        obstacles = self._context.surroundings.obstacles
        count = min(SECTORS, math.ceil(math.tau / abs(step_rad) - 1e-6))
        for k in np.flatnonzero(known[:count]).tolist():
            distance_m = max(nearest_m, float(values[k]))
            if reach_m > 0.0 and distance_m > reach_m:
                distance_m = math.inf
            obstacles.take(first_rad + k * step_rad, abs(step_rad), distance_m, time_us)
        return True

    def _beam(self, message: dialect.MAVLink_distance_sensor_message, time_us: int) -> bool:
        """DISTANCE_SENSOR (132) in one of the eight horizontal directions."""
        if message.orientation not in _HORIZONTAL:
            return False
        reach_m, distance_m = message.max_distance * 0.01, message.current_distance * 0.01
        if distance_m < message.min_distance * 0.01:
            return False
        direction_rad = (message.orientation - dialect.MAV_SENSOR_ROTATION_NONE) * math.pi / 4.0
        width = float(message.horizontal_fov)
        width = width if 0.01 < width < math.tau else _SENSOR_WIDTH_RAD
        self._context.surroundings.obstacles.take(
            direction_rad, max(SECTOR_RAD, width), math.inf if distance_m >= reach_m else distance_m, time_us
        )
        return True
