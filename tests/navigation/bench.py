"""Runs the filter along a kinematic flight through the simulated sensors, and measures its errors."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import NavigationFilter, NavigationParameters, layout
from autopilot_bridge.navigation import states as s
from estimators.tracking import metrics
from flightsim import truth as t
from flightsim.foundation.geodesy import FrameAt, LocalFrame
from flightsim.foundation.random_streams import RandomStreams
from flightsim.sensors.suite import SensorSuite, SensorSuiteParameters
from tests.navigation.kinematic_flight import MAG_NED_GAUSS, RATE_HZ
from tests.navigation.matched import MATCHED
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]

PARAMETERS = NavigationParameters(mag_ned_gauss=MAG_NED_GAUSS, **MATCHED)


def attitude_error(q_true: Array, q_estimated: Array) -> Array:
    """Rotation vector theta in NED with R_true = exp([theta]x) R_estimated, small angles."""
    m = rotation_matrix(q_true) @ rotation_matrix(q_estimated).T
    axis = 0.5 * np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    sine = float(np.linalg.norm(axis))
    cosine = 0.5 * (float(np.trace(m)) - 1.0)
    return axis * (np.arctan2(sine, cosine) / sine if sine > 1e-9 else 1.0)


class Bench:
    """Sensors and filter on a recorded truth; `run` steps them, `error` compares."""

    def __init__(
        self,
        truth: Array,
        *,
        seed: int = 1,
        sensors: SensorSuiteParameters | None = None,
        parameters: NavigationParameters = PARAMETERS,
        rate_hz: int = RATE_HZ,
        frame_at: FrameAt = LocalFrame,
    ) -> None:
        self.truths = truth
        self.truth = truth[0].copy()
        streams = RandomStreams(seed)
        self.suite = SensorSuite(
            SensorSuiteParameters() if sensors is None else sensors,
            physics_rate_hz=rate_hz,
            truth=self.truth,
            seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
        )
        self.filter = NavigationFilter(
            parameters, readings=self.suite.readings, physics_rate_hz=rate_hz, frame_at=frame_at
        )
        self.period_us = 1_000_000 // rate_hz
        self.rate_hz = rate_hz
        self.step = 0

    @property
    def time_s(self) -> float:
        return self.step / self.rate_hz

    def run(self, until_s: float, each: Callable[[], None] | None = None) -> "Bench":
        """Step until a time; `each` is called after every step, between sensors and nothing else."""
        suite, nav, truth = self.suite, self.filter, self.truth
        for i in range(self.step, round(until_s * self.rate_hz)):
            truth[:] = self.truths[i]
            time_us = (i + 1) * self.period_us
            suite.step(time_us)
            nav.step(time_us)
            self.step = i + 1
            if each is not None:
                each()
        return self

    def error(self) -> Array:
        """Attitude (rad, NED), velocity, position error: true minus estimated (9,)."""
        nav, state = self.filter, self.filter.state
        out = np.zeros(9)
        out[0:3] = attitude_error(self.truth[t.Q_NED_FROM_FRD], state[layout.Q_NED_FROM_FRD])
        out[3:6] = self.truth[t.VEL_NED_M_S] - state[layout.VEL_NED_M_S]
        if nav.frame is not None:
            lat, lon = np.degrees(self.truth[t.LAT_RAD]), np.degrees(self.truth[t.LON_RAD])
            out[6:9] = nav.frame.ned_from_geodetic(lat, lon, self.truth[t.ALT_M]) - state[layout.POS_NED_M]
        return out

    def nees(self) -> Array:
        """Normalised estimation error squared of (attitude, velocity, position), three degrees of freedom
        each."""
        error, p = self.error(), self.filter.covariance
        return np.array(
            [metrics.nees(error[i : i + 3], p[i : i + 3, i : i + 3]) for i in (s.ATT, s.VEL, s.POS)]
        )
