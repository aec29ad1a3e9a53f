"""Pseudo-measurements without other aiding: standing still, and position or height held.

A fixed wing in flight without any aiding has moved, so its position is not held: holding it would make the
filter interpret centripetal acceleration as tilt.
"""

import math
from typing import Final

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.clocks import Clocks
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution

_TURN_GATE: Final = 5.0  # standard deviations of the gyro's mean beyond which the vehicle itself turns
_STEADY_US: Final = 10_000_000  # no wind turns a parked vehicle this long at one rate: that is a bias
_HELD_VELOCITY_M_S: Final = 2.0  # 1-sigma of the velocity when the position begins to be held in flight


class Standby:
    """Prepares these updates of a `Solution`.

    Attributes:
        held: nothing aids the horizontal position; it is held, or adrift.
    """

    def __init__(self, solution: Solution, clocks: Clocks) -> None:
        self._solution = solution
        self._clocks = clocks
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self.held = False
        self._adrift = False
        self._rested = False
        self._turn_rad_s = (0.0, 0.0, 0.0)
        self._turning_since_us = -1

    def release(self) -> None:
        """The position is aided again."""
        self.held = self._adrift = False

    def prepare(
        self, parameters: NavigationParameters, time_us: int, *, at_rest: bool, winged: bool, flying: bool
    ) -> int:
        """What of this to fuse at `time_us` (bits of `fusion`), with its variances written into `obs`.

        Args:
            at_rest: the vehicle stands on the ground.
            winged, flying: it is a fixed wing, and in flight.
        """
        p, solution, obs, clocks = parameters, self._solution, self._solution.obs, self._clocks
        has = 0
        if at_rest:
            if self._rested and not self._is_turned(parameters, time_us):
                has |= f.HAS_REST
            else:
                f.restart_mean_rate(solution.core)
                if self.held and not self._rested:
                    self._forget_velocity()
        self._rested = at_rest
        lost = clocks.horizontal_aid_us < 0 or time_us - clocks.horizontal_aid_us > p.no_aid_timeout_s * 1e6
        if lost and not self.held:
            self._hold(flying=flying)
        may_leave = clocks.horizontal_aid_us >= 0 or winged  # a launch must not be held back
        sigma = p.no_aid_noise_m if may_leave and not at_rest else p.at_rest_noise_m
        if self.held and flying:
            self._adrift = True
        elif self.held:
            if self._adrift:
                self._hold(flying=False)
            obs[f.HOLD_VAR] = sigma * sigma
            has |= f.HAS_HOLD
        if time_us - clocks.height_us > p.height_timeout_s * 1e6:
            if not clocks.height_held:
                obs[f.HOLD + 2] = solution.core[s.X_POS + 2]
            clocks.height_held = True
            obs[f.HOLD_HEIGHT_VAR] = sigma * sigma
            has |= f.HAS_HOLD_HEIGHT
        else:
            clocks.height_held = False
        return has

    def _is_turned(self, parameters: NavigationParameters, time_us: int) -> bool:
        """The vehicle stands but turns: a gust rocks an aircraft and turns it on its wheels.

        If the turn were interpreted as the gyro's bias, the heading would not follow it, and the wrong bias
        would turn the heading in flight. The vehicle's centre does not stand still in such a turn either.
        """
        core, p = self._solution.core, self._solution.p
        span_s = core[s.SUM_GYRO_TIME]
        if not span_s > 0.0:
            return False
        rate = [float(core[s.SUM_GYRO + a] / span_s) for a in range(3)]
        floor = parameters.zero_rate_noise_rad_s**2
        gate = [_TURN_GATE * math.sqrt(float(p[s.GYRO_BIAS + a, s.GYRO_BIAS + a]) + floor) for a in range(3)]
        turned = any(abs(rate[a] - float(core[s.X_GYRO_BIAS + a])) > gate[a] for a in range(3))
        if not turned:
            self._turning_since_us = -1
            return False
        changed = any(abs(rate[a] - self._turn_rad_s[a]) > gate[a] for a in range(3))
        if self._turning_since_us < 0 or changed:
            self._turning_since_us = time_us
            self._turn_rad_s = (rate[0], rate[1], rate[2])
        return time_us - self._turning_since_us < _STEADY_US

    def _hold(self, *, flying: bool) -> None:
        """Hold the present position from now on, and assume a velocity near zero."""
        solution, core = self._solution, self._solution.core
        solution.obs[f.HOLD : f.HOLD + 2] = core[s.X_POS : s.X_POS + 2]
        self.held = True
        self._adrift = flying
        if not flying:
            self._forget_velocity()

    def _forget_velocity(self) -> None:
        """About zero is the best guess of a horizontal velocity that nothing has measured lately."""
        solution, core = self._solution, self._solution.core
        if self._clocks.horizontal_aid_us >= 0:
            north, east = float(core[s.X_VEL]), float(core[s.X_VEL + 1])
            solution.change_velocity(-north, -east, sigma_m_s=_HELD_VELOCITY_M_S)
