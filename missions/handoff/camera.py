"""Points the gimbal of one aircraft at a place of its level frame."""

import math
from typing import Final

from estimators.tracking.line_of_sight import pointing_angles
from flightsim.foundation.vectors import from_euler
from missions.vehicle.telemetry import Attitude
from missions.vehicle.vehicle import Vehicle

GIMBAL_HZ: Final = 25.0
_LEAD_S: Final = 0.15  # of gimbal and link


class GimbalPointing:
    """The gimbal of one aircraft.

    Args:
        vehicle: the aircraft; its gimbal is taken over.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._before: tuple[int, float] | None = None
        vehicle.payload.take_gimbal_control()
        vehicle.payload.set_gimbal_rate(GIMBAL_HZ)

    def point(self, place_m: tuple[float, float], height_m: float) -> None:
        """Point at a place on the ground.

        Args:
            place_m: forward and right in the level frame.
            height_m: height over the ground.
        """
        attitude = self._vehicle.latest(Attitude)
        if attitude is None or not height_m > 1.0:
            return
        now_us, yaw = self._vehicle.clock.stamp_us, attitude.yaw_rad
        before, self._before = self._before, (now_us, yaw)
        turn = 0.0
        if before is not None and 0 < now_us - before[0] < 500_000:
            # the place turns against the nose while the gimbal follows
            turn = -_LEAD_S * math.remainder(yaw - before[1], math.tau) / ((now_us - before[0]) * 1e-6)
        c, s = math.cos(turn), math.sin(turn)
        forward, right = c * place_m[0] - s * place_m[1], s * place_m[0] + c * place_m[1]
        azimuth, elevation = pointing_angles(
            (forward, right, height_m), from_euler(attitude.roll_rad, attitude.pitch_rad, 0.0)
        )
        self._vehicle.payload.point_gimbal(pitch_rad=elevation, yaw_rad=azimuth)
