"""Aircraft as points that turn at one rate in wind, over a target: what a search is tried out on."""

import math

import numpy as np

from estimators.occupancy.detection import AnomalyDetector
from missions.occupancy.pilot import Motion, Pilot
from missions.occupancy.search import Search

STEP_S = 0.1


class Aircraft:
    """One searcher.

    Args:
        search: of the team.
        index: which of it.
        start_ne_m: where its search begins.
        wind_ne_m_s: where the air moves to.
    """

    def __init__(
        self, search: Search, index: int, start_ne_m, *, airspeed_m_s=25.0, wind_ne_m_s=(0.0, 0.0), seed=0
    ):
        self.search, self.index = search, index
        self.pilot = Pilot(search, index, start_ne_m=start_ne_m)
        self.detector = AnomalyDetector(threshold_nt=3.0)
        self.place = [0.0, 25.0 * index]
        self.heading_rad = self.wanted_rad = 0.0
        self.airspeed_m_s, self.wind = airspeed_m_s, wind_ne_m_s
        self.turn_rad_s = math.tan(math.radians(35.0)) * 9.81 / airspeed_m_s
        self.rng = np.random.default_rng((seed, index))
        self.track = []

    def step(self, time_us: int, target_ne_m) -> None:
        most = self.turn_rad_s * STEP_S
        turn = math.remainder(self.wanted_rad - self.heading_rad, math.tau)
        self.heading_rad += max(-most, min(most, turn))
        velocity = (
            self.airspeed_m_s * math.cos(self.heading_rad) + self.wind[0],
            self.airspeed_m_s * math.sin(self.heading_rad) + self.wind[1],
        )
        for axis in (0, 1):
            self.place[axis] += velocity[axis] * STEP_S
        north_m, east_m = self.place
        self.track.append((north_m, east_m))
        distance2 = (north_m - target_ne_m[0]) ** 2 + (east_m - target_ne_m[1]) ** 2
        reading_nt = 30.0 * math.exp(-0.5 * distance2 / 70.0**2) + self.rng.normal(0.0, 0.3)
        anomaly = self.detector.update(time_us + 1, reading_nt, 0.0, north_m, east_m)
        self.search.report_place(self.index, time_us, north_m, east_m, anomalous=self.detector.anomalous)
        if anomaly is not None:
            self.search.report_anomaly(self.index, anomaly)
        command = self.pilot.update(
            Motion(
                time_us=time_us,
                north_m=north_m,
                east_m=east_m,
                vel_ne_m_s=velocity,
                yaw_rad=self.heading_rad,
                airspeed_m_s=self.airspeed_m_s,
                wind_ne_m_s=self.wind,
            )
        )
        if command is not None:
            self.wanted_rad = command.heading_rad
