"""Height of the ground below: a scalar Kalman filter on the rangefinder."""

import math
from typing import Final

from autopilot_bridge.navigation.delayed_fusion import body_axis_in_ned
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.states import CORRECTION_POS, TERRAIN_DOWN, X_POS, X_VEL
from flightsim.interface import RANGE_DISTANCE_M, Reading

_MAX_RANGE_M: Final = 1.0e4
_RESET_REFUSED_US: Final = 1_000_000  # refused for this long: the ground has another height here


class TerrainEstimator:
    """Down position of the terrain as a random walk that also grows with the distance flown.

    Attributes:
        down_m: of the ground, in the filter's frame; NaN before anything is known.
        test_ratio: of the newest range.
        in_use: the newest range was accepted.
    """

    def __init__(self, parameters: NavigationParameters) -> None:
        self._parameters = parameters
        self.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning; what is known of the ground stays."""
        self._parameters = parameters

    def restart(self) -> None:
        """Nothing is known of the ground."""
        self.down_m = math.nan
        self.test_ratio = 0.0
        self.in_use = False
        self._variance = math.inf
        self._fused_us = -1
        self._predicted_us = -1

    def valid(self, time_us: int) -> bool:
        """A measurement has been taken in within the time-out."""
        timeout_us = round(self._parameters.terrain_timeout_s * 1e6)
        return self._fused_us >= 0 and time_us - self._fused_us <= timeout_us

    def shift(self, down_m: float) -> None:
        """The frame's height has jumped: the ground moves along."""
        self.down_m += down_m

    def predict(self, time_us: int, speed_m_s: float) -> None:
        """Let the uncertainty grow up to `time_us` at a horizontal speed; give up what has become too old."""
        p = self._parameters
        elapsed_s = (time_us - self._predicted_us) * 1e-6 if self._predicted_us >= 0 else 0.0
        self._predicted_us = time_us
        self._variance += elapsed_s * (
            p.terrain_walk_m_per_sqrt_s**2 + (p.terrain_gradient * speed_m_s) ** 2 * 0.1
        )
        if not self.valid(time_us):
            self.down_m = math.nan
            self.in_use = False

    def landed(self, time_us: int, down_m: float) -> None:
        """The vehicle stands on the ground at `down_m`."""
        self.down_m = down_m + self._parameters.ground_clearance_m
        self._variance = self._parameters.rangefinder_noise_m**2
        self._fused_us = time_us

    def fuse(self, time_us: int, distance_m: float, cos_tilt: float, down_m: float) -> None:
        """A range along the body's down axis, taken at height `down_m`."""
        p = self._parameters
        if not 0.0 < distance_m < _MAX_RANGE_M or cos_tilt < math.cos(p.rangefinder_max_tilt_rad):
            self.in_use = False
            return
        measured = down_m + distance_m * cos_tilt
        noise = p.rangefinder_noise_m**2 + (p.rangefinder_noise_fraction * distance_m) ** 2
        if math.isnan(self.down_m):
            self.down_m, self._variance, self._fused_us = measured, noise, time_us
            self.in_use, self.test_ratio = True, 0.0
            return
        s = self._variance + noise
        innovation = measured - self.down_m
        self.test_ratio = abs(innovation) / (p.rangefinder_gate * math.sqrt(s))
        self.in_use = self.test_ratio <= 1.0
        if self.in_use:
            gain = self._variance / s
            self.down_m += gain * innovation
            self._variance *= 1.0 - gain
            self._fused_us = time_us
        elif time_us - self._fused_us > _RESET_REFUSED_US:
            self.down_m, self._variance, self._fused_us = measured, noise, time_us


def update_terrain(
    terrain: TerrainEstimator,
    solution: Solution,
    ranged: Reading | None,
    time_us: int,
    *,
    slow: bool,
    at_rest: bool,
) -> None:
    """Predict at the slow rate, take a new range if there is one, and write the terrain into `solution`."""
    core = solution.core
    if slow:
        terrain.predict(time_us, math.hypot(core[X_VEL], core[X_VEL + 1]))
        if at_rest:
            terrain.landed(time_us, float(core[X_POS + 2]))
    if ranged is not None:
        row = solution.row_at(ranged.time_us, time_us)
        if row >= 0:
            cos_tilt = body_axis_in_ned(solution.history, row, 2)[2]
            down = float(solution.history[row, 2] + core[CORRECTION_POS + 2])
            terrain.fuse(time_us, float(ranged.values[RANGE_DISTANCE_M]), cos_tilt, down)
    core[TERRAIN_DOWN] = terrain.down_m
