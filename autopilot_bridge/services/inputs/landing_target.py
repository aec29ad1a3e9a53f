"""LANDING_TARGET: the landing place as an onboard detector measures it.

Sources: MAVLink landing target protocol; PX4 1.16 accepts positions in LOCAL_NED and angles, ArduPilot 4.6
positions in BODY_FRD or LOCAL_FRD and angles (PLND_TYPE 1). Angles are off the optical axis, right and
downwards in the image; the camera looks straight down with the top of its image forward, unless the vehicle's
own gimbal reports where it points (GIMBAL_DEVICE_ATTITUDE_STATUS of component 154, for the camera, component
100).
"""

import math
from collections import deque
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import CAMERA_COMPONENT, GIMBAL_COMPONENT
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.channel import Receiver, Source
from autopilot_bridge.services.inputs.timesync import in_vehicle_time
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim.airframe import AirframeKind
from flightsim.foundation.vectors import from_euler, rotate, yaw_of

Array = NDArray[np.float64]

_YAW_IN_EARTH: Final = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
_GIMBAL_US: Final = 500_000
_MAX_ANGLE_RAD: Final = 1.3
_STEEPEST: Final = 0.2  # smallest downward component of a usable line of sight
_ANGLE_SIGMA_RAD: Final = math.radians(1.0)
_LEAST_SIGMA_M: Final = 0.05
_MAX_DISTANCE_M: Final = 200.0


class LandingTargetService(Microservice):
    """Keeps `surroundings.landing_target` up to date.

    Attributes:
        refused: number of messages without usable content.
    """

    def __init__(self, parts: AutopilotParts) -> None:
        self._context = parts.commander.context
        self._navigation = parts.navigation
        self._system_id = parts.system_id
        self._lands_there = parts.kind is AirframeKind.MULTICOPTER
        self._gimbal: deque[tuple[int, Array, bool]] = deque(maxlen=32)
        self.refused = 0

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """LANDING_TARGET, and GIMBAL_DEVICE_ATTITUDE_STATUS of the vehicle's own gimbal."""
        if not self._lands_there:
            return {}
        return super().receivers

    @receives(dialect.MAVLink_landing_target_message)
    def _on_target(
        self, message: dialect.MAVLink_landing_target_message, source: Source, time_us: int
    ) -> None:
        """A landing target from the vehicle's own payload or from any other system."""
        place = self._place(message, source, time_us)
        track = self._context.surroundings.landing_target
        if place is None or not track.take(place[0], place[1], sigma_m=place[2]):
            self.refused += 1

    @receives(dialect.MAVLink_gimbal_device_attitude_status_message)
    def _on_gimbal(
        self, message: dialect.MAVLink_gimbal_device_attitude_status_message, source: Source, time_us: int
    ) -> None:
        if source.system_id != self._system_id or source.component_id != GIMBAL_COMPONENT:
            return
        q = np.array(message.q, dtype=np.float64)
        if 0.9 < float(q @ q) < 1.1:  # False for NaN
            in_earth = bool(message.flags & _YAW_IN_EARTH)
            self._gimbal.append((in_vehicle_time(message.time_boot_ms * 1000, time_us), q, in_earth))

    def _place(
        self, message: dialect.MAVLink_landing_target_message, source: Source, time_us: int
    ) -> tuple[int, Array, float] | None:
        """(time, local NED, 1-sigma) from the message; None if the message is not usable."""
        measured_us = in_vehicle_time(int(message.time_usec), time_us)
        pose = self._navigation.past_pose(measured_us, time_us)
        if pose is None or not self._context.position_valid:
            return None
        position, q = pose
        if message.position_valid:
            place = np.array((message.x, message.y, message.z), dtype=np.float64)
            if not float(np.abs(place).max()) < 1e5:
                return None
            if message.frame == dialect.MAV_FRAME_LOCAL_NED:
                return measured_us, place, _LEAST_SIGMA_M
            if message.frame in (dialect.MAV_FRAME_BODY_FRD, dialect.MAV_FRAME_LOCAL_FRD):
                offset = rotated(q if message.frame == dialect.MAV_FRAME_BODY_FRD else _heading(q), place)
                return measured_us, position + offset, _LEAST_SIGMA_M
            return None
        angle_x, angle_y = float(message.angle_x), float(message.angle_y)
        if not (abs(angle_x) < _MAX_ANGLE_RAD and abs(angle_y) < _MAX_ANGLE_RAD):
            return None
        line = self._line_of_sight(source, measured_us, q, math.tan(angle_x), math.tan(angle_y))
        if line[2] < _STEEPEST:
            return None
        distance = float(message.distance)
        height = float(self._context.nav[nav.HEIGHT_ABOVE_GROUND_M])
        if math.isnan(height):
            height = self._context.height_above_home_m
        if not 0.0 < distance < _MAX_DISTANCE_M:
            distance = max(0.0, height) / float(line[2])
        if not 0.0 < distance < _MAX_DISTANCE_M:
            return None
        return measured_us, position + distance * line, _LEAST_SIGMA_M + _ANGLE_SIGMA_RAD * distance

    def _line_of_sight(self, source: Source, measured_us: int, q: Array, right: float, down: float) -> Array:
        """Unit vector to the target, NED.

        Args:
            right, down: in the image, tangents of the angles off the optical axis.
        """
        gimbal = None
        if source.system_id == self._system_id and source.component_id == CAMERA_COMPONENT:
            gimbal = min(self._gimbal, key=lambda entry: abs(entry[0] - measured_us), default=None)
        if gimbal is not None and abs(gimbal[0] - measured_us) < _GIMBAL_US:
            line = rotated(gimbal[1], np.array((1.0, right, down)))
            if not gimbal[2]:
                line = rotated(_heading(q), line)
        else:
            line = rotated(q, np.array((-down, right, 1.0)))
        unit: Array = line / math.sqrt(float(line @ line))
        return unit


def rotated(q: Array, vector: Array) -> Array:
    """A vector turned by a unit quaternion."""
    w, x, y, z = q.tolist()
    north, east, down = vector.tolist()
    return np.array(rotate((w, x, y, z), (north, east, down)))


def _heading(q: Array) -> Array:
    """The rotation about the vertical in an attitude."""
    return np.array(from_euler(0.0, 0.0, yaw_of(q.tolist())))
