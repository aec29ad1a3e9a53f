"""The heading of external odometry: fused in place of the compass, or compared with the filter's own.

A sender in LOCAL_FRD has a separate heading reference, which is not north. Where it is fused the filter takes
it over. Else the angle between the two frames is found by comparing headings.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import external_fusion as e
from autopilot_bridge.navigation.external import ExternalFrame, ExternalSample, variance_of
from autopilot_bridge.navigation.external_parameters import ExternalParameters
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.solution import UNKNOWN_VELOCITY_M_S, Solution
from autopilot_bridge.navigation.states import HISTORY_Q, X_VEL
from flightsim.foundation.vectors import yaw_of

Array = NDArray[np.float64]

_COHERENT_SAMPLES: Final = 5
_COHERENT_RAD: Final = 0.2
_SMOOTHING: Final = 0.1  # share of a new difference of headings
_AGREES_SIGMAS: Final = 3.0


class ExternalHeading:
    """Prepares the heading of samples.

    Attributes:
        in_use: the heading is the sender's; the compass is left out.
        own: and it doesn't refer to north.
    """

    def __init__(self, *, solution: Solution, health: NavigationHealth, obs: Array) -> None:
        self._solution = solution
        self._health = health
        self._obs = obs
        self.restart()

    def restart(self) -> None:
        """Nothing is known of the sender."""
        self.in_use = False
        self.own = False
        self._coherent = 0
        self._difference_rad = math.nan
        self._turn_rad = math.nan
        self._fused_us = self._refused_since_us = -1

    def take(
        self,
        parameters: ExternalParameters,
        sample: ExternalSample,
        yaw_rad: float,
        row: int,
        time_us: int,
        *,
        jumped: bool,
        placed: bool,
    ) -> tuple[int, bool]:
        """Prepare the heading: (parts to fuse, the estimate was turned to it).

        Args:
            jumped: the sender's estimate has.
            placed: its positions move as the vehicle does; else its heading isn't begun with.
        """
        p, obs = parameters, self._obs
        angle = math.remainder(yaw_rad - self._ours(row), math.tau)
        moved = math.remainder(angle - self._difference_rad, math.tau)
        self._coherent = self._coherent + 1 if abs(moved) < _COHERENT_RAD else 0
        self._difference_rad = angle
        variance = variance_of(sample.yaw_variance_rad2, p.yaw_noise_rad, own=p.own_noise)
        obs[e.EXT_YAW] = yaw_rad
        obs[e.EXT_YAW_VAR] = variance
        own = sample.frame is ExternalFrame.LOCAL_FRD
        coherent = placed and self._coherent >= _COHERENT_SAMPLES
        lost = self._refused_since_us >= 0 and time_us - self._refused_since_us > p.reset_after_s * 1e6
        if self.in_use and own is self.own and not jumped and not (lost and coherent):
            return e.EXT_HAS_YAW, False
        if not (coherent or (jumped and self.in_use)):
            return (e.EXT_HAS_YAW if self.in_use else 0), False
        agrees = not own and abs(angle) < _AGREES_SIGMAS * math.sqrt(variance)
        starts = not self.in_use
        self.in_use, self.own = True, own
        self._fused_us = time_us
        self._refused_since_us = -1
        if starts and agrees:
            return e.EXT_HAS_YAW, False  # with the compass
        self._turn_estimate(angle, math.sqrt(variance))
        return e.EXT_HAS_YAW, True

    def _turn_estimate(self, angle_rad: float, sigma_rad: float) -> None:
        solution, health = self._solution, self._health
        solution.turn_yaw(angle_rad, yaw_sigma_rad=sigma_rad)
        c, s = math.cos(angle_rad), math.sin(angle_rad)
        north, east = float(solution.core[X_VEL]), float(solution.core[X_VEL + 1])
        solution.change_velocity(
            c * north - s * east - north, s * north + c * east - east, sigma_m_s=UNKNOWN_VELOCITY_M_S
        )
        self._difference_rad = 0.0
        health.yaw_aligned = True
        health.yaw_resets += 1
        health.yaw_reset_rad = angle_rad

    def note(self, accepted: bool, time_us: int) -> None:
        """What came of the heading that was prepared."""
        if accepted:
            self._fused_us = time_us
            self._refused_since_us = -1
        elif self._refused_since_us < 0:
            self._refused_since_us = time_us

    def watch(self, parameters: ExternalParameters, time_us: int) -> None:
        """Give the heading back to the compass when the sender is silent or refused for long."""
        silent = time_us - self._fused_us > parameters.timeout_s * 1e6
        if self.in_use and (silent or not parameters.use_yaw):
            if self.own:
                self._health.yaw_aligned = False  # the compass aligns it with its next sample
            self.restart()

    def turn_to_ned(self, sample: ExternalSample, yaw_rad: float, row: int) -> float:
        """Angle by which the sample's local frame is turned against the filter's; NaN: not known.

        Args:
            yaw_rad: the sample's heading; NaN: it has none.
        """
        if sample.frame is ExternalFrame.NED or self.in_use:
            return 0.0
        if math.isnan(yaw_rad):
            return math.nan
        difference = math.remainder(self._ours(row) - yaw_rad, math.tau)
        if math.isnan(self._turn_rad):
            self._turn_rad = difference
        self._turn_rad += _SMOOTHING * math.remainder(difference - self._turn_rad, math.tau)
        return self._turn_rad

    def _ours(self, row: int) -> float:
        return yaw_of(self._solution.history[row, HISTORY_Q : HISTORY_Q + 4].tolist())
