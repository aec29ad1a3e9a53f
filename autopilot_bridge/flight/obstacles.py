"""Distances to obstacles around the vehicle, by direction: from OBSTACLE_DISTANCE and DISTANCE_SENSOR.

The horizontal circle has 72 sectors of 5 degrees, clockwise from the nose. A sector stores its distance, the
time of the measurement, and whether anything was within range.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SECTORS: Final = 72
SECTOR_RAD: Final = math.tau / SECTORS


class ObstacleMap:
    """The obstacle distances on the circle.

    Attributes:
        distances_m: by sector; infinite: nothing within range; NaN: never measured.
        measured_us: time of each measurement; -1: never.
    """

    def __init__(self) -> None:
        self.distances_m: Array = np.full(SECTORS, math.nan)
        self.measured_us: NDArray[np.int64] = np.full(SECTORS, -1, dtype=np.int64)
        self.newest_us = -1

    def take(self, first_rad: float, width_rad: float, distance_m: float, time_us: int) -> None:
        """Add a measurement: it sets the distance of all sectors that its direction overlaps.

        Args:
            first_rad: centre of the direction, clockwise from the nose.
            width_rad: its full angle.
            distance_m: infinite: nothing within range.
        """
        half = max(0.0, 0.5 * width_rad)
        first = math.floor((first_rad - half) / SECTOR_RAD + 0.5 + 1e-9)
        last = math.ceil((first_rad + half) / SECTOR_RAD - 0.5 - 1e-9)
        count = min(SECTORS, max(1, last - first + 1))
        for k in range(count):
            sector = (first + k) % SECTORS
            fresh = self.measured_us[sector] == time_us
            known = float(self.distances_m[sector])
            self.distances_m[sector] = min(known, distance_m) if fresh else distance_m
            self.measured_us[sector] = time_us
        self.newest_us = time_us

    def speed_limit(
        self,
        direction_rad: float,
        time_us: int,
        *,
        margin_m: float,
        acceleration_m_s2: float,
        delay_s: float,
        guard_rad: float,
        timeout_us: int,
    ) -> float:
        """Greatest speed in a direction from which the vehicle can stop before the margin.

        For a sector at angle a from the direction with distance d, the free distance along the direction is
        (d - margin) / cos(a). With the delay T and the deceleration b: v T + v^2 / (2 b) = free distance.

        Args:
            direction_rad: clockwise from the nose.
            guard_rad: sectors within this angle count.
            timeout_us: sectors measured longer ago are not used.

        Returns:
            Infinite without an obstacle; 0 at the margin.
        """
        limit = math.inf
        reach = math.ceil(guard_rad / SECTOR_RAD)
        middle = round(direction_rad / SECTOR_RAD)
        for k in range(middle - reach, middle + reach + 1):
            sector = k % SECTORS
            off = math.remainder(k * SECTOR_RAD - direction_rad, math.tau)
            measured_us = int(self.measured_us[sector])
            distance_m = float(self.distances_m[sector])
            if (
                abs(off) > guard_rad
                or measured_us < 0
                or time_us - measured_us > timeout_us
                or not math.isfinite(distance_m)
            ):
                continue
            room = max(0.0, distance_m - margin_m) / math.cos(off)
            b, t = acceleration_m_s2, delay_s
            limit = min(limit, b * (math.sqrt(t * t + 2.0 * room / b) - t))
        return limit

    def known(self, direction_rad: float, time_us: int, *, timeout_us: int) -> bool:
        """This direction was measured within `timeout_us`."""
        sector = round(direction_rad / SECTOR_RAD) % SECTORS
        measured_us = int(self.measured_us[sector])
        return measured_us >= 0 and time_us - measured_us <= timeout_us
