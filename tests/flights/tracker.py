"""A motion-capture hall and a wall around a flight: messages made from the truth, as others send them."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.flights.flight import Flight
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]

VISION: dict[str, dict[str, float]] = {
    "px4": {"EKF2_EV_CTRL": 15, "EKF2_GPS_CTRL": 0, "EKF2_HGT_REF": 3},
    "ardupilot": {
        "VISO_TYPE": 1,
        "EK3_SRC1_POSXY": 6,
        "EK3_SRC1_VELXY": 6,
        "EK3_SRC1_POSZ": 6,
        "EK3_SRC1_VELZ": 6,
        "EK3_SRC1_YAW": 6,
    },
}
"""Parameters of a vehicle that flies by external odometry."""


class Tracker:
    """Sees the vehicle from outside, to a centimetre."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        self.jump_m = (0.0, 0.0, 0.0)
        self._rng = np.random.Generator(np.random.PCG64(5))

    def odometry(self, time_s: float) -> Any:
        """ODOMETRY in LOCAL_FRD with velocities in BODY_FRD."""
        truth = self.flight.truth
        q = truth[t.Q_NED_FROM_FRD]
        place = np.array(self.flight.position_ned_m) + self._rng.normal(0.0, 0.01, 3) + self.jump_m
        velocity = rotation_matrix(q).T @ truth[t.VEL_NED_M_S] + self._rng.normal(0.0, 0.02, 3)
        unknown = [math.nan] * 21
        return dialect.MAVLink_odometry_message(  # type: ignore[call-arg]
            self.flight.sitl.time_us,
            dialect.MAV_FRAME_LOCAL_FRD,
            dialect.MAV_FRAME_BODY_FRD,
            *place,
            list(q),
            *velocity,
            0.0,
            0.0,
            0.0,
            unknown,
            unknown,
            0,
            dialect.MAV_ESTIMATOR_TYPE_VIO,
            100,
        )

    def vision(self, time_s: float) -> Any:
        """VISION_POSITION_ESTIMATE, with a Unix time stamp."""
        r = rotation_matrix(self.flight.truth[t.Q_NED_FROM_FRD])
        place = np.array(self.flight.position_ned_m) + self._rng.normal(0.0, 0.01, 3) + self.jump_m
        angles = math.atan2(r[2, 1], r[2, 2]), -math.asin(r[2, 0]), math.atan2(r[1, 0], r[0, 0])
        stamp_us = 1_700_000_000_000_000 + self.flight.sitl.time_us
        return dialect.MAVLink_vision_position_estimate_message(stamp_us, *place, *angles, [math.nan] * 21, 0)  # type: ignore[call-arg]


def frame_at_home(flight: Flight) -> LocalFrame:
    """Places of the world, NED from home."""
    home = flight.sitl.spec.place
    return LocalFrame(GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m))


def wall_to_the_north(flight: Flight, north_m: float) -> Any:
    """OBSTACLE_DISTANCE of a scanner that turns with the vehicle, before an endless wall."""
    room_m = north_m - flight.position_ned_m[0]
    ranges = []
    for k in range(72):
        c = math.cos(flight.yaw_rad + math.radians(5.0 * k))
        ranges.append(round(100.0 * min(40.01, max(0.0, room_m) / c)) if c > 1e-6 else 4001)
    return dialect.MAVLink_obstacle_distance_message(
        flight.sitl.time_us, 0, ranges, 5, 20, 4000, 0.0, 0.0, dialect.MAV_FRAME_BODY_FRD
    )
