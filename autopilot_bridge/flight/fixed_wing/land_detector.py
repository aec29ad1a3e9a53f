"""Is the aircraft on the ground? As PX4's `FixedwingLandDetector`: it is when it is slow and nothing happens.

A stationary aircraft in a strong wind has an airspeed, so airspeed counts only while the speed over ground
isn't known. An aircraft that waits for its launch stands still, and so stays on the ground until it is
thrown.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, LandedState
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.checks import Positive
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

_IDLE_THROTTLE: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class LandDetectorParameters(Options):
    """Thresholds; PX4's names beside the fields."""

    horizontal_speed_max_m_s: Positive = 5.0  # LNDFW_VEL_XY_MAX
    vertical_speed_max_m_s: Positive = 1.0  # LNDFW_VEL_Z_MAX
    airspeed_max_m_s: Positive = 6.0  # LNDFW_AIRSPD_MAX
    acceleration_max_m_s2: Positive = 8.0  # LNDFW_XYACC_MAX
    rotation_max_rad_s: Positive = 0.5  # LNDFW_ROT_MAX
    trigger_time_s: Positive = 2.0  # LNDFW_TRIG_TIME
    contact_speed_m_s: Positive = 0.25  # vertical, throttle closed, so long:
    contact_time_s: Positive = 0.8
    filter_time_s: Positive = 0.5  # of speeds and accelerations


@kernel
def _smooth(nav: Array, keep: float, smoothed: Array) -> None:
    """Low-pass ground speed, vertical speed, airspeed and horizontal acceleration, in this order.

    An unknown value leaves what was known. Behind them: the rate of turn and the vertical speed of now.
    """
    vertical = abs(nav[nav_layout.VEL + 2])
    newest = (
        math.hypot(nav[nav_layout.VEL], nav[nav_layout.VEL + 1]),
        vertical,
        nav[nav_layout.AIRSPEED_M_S],
        math.hypot(nav[nav_layout.ACC], nav[nav_layout.ACC + 1]),
    )
    for i in range(4):
        if not math.isnan(newest[i]):
            smoothed[i] = newest[i] + (smoothed[i] - newest[i]) * keep
    smoothed[4] = math.sqrt(
        nav[nav_layout.RATES] ** 2 + nav[nav_layout.RATES + 1] ** 2 + nav[nav_layout.RATES + 2] ** 2
    )
    smoothed[5] = vertical


class LandDetector:
    """Judges the landed state at the task rate.

    Args:
        parameters: thresholds.
        on_ground: where the aircraft starts.

    Attributes:
        state: newest judgement.
    """

    def __init__(self, parameters: LandDetectorParameters | None = None, *, on_ground: bool = True) -> None:
        self._parameters = LandDetectorParameters() if parameters is None else parameters
        self._slow_s = self._contact_s = math.inf if on_ground else 0.0
        self._smoothed: Array = np.zeros(6)
        self.state = LandedState.ON_GROUND if on_ground else LandedState.IN_AIR

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        """Judge, and write `landed_state`, `ground_contact` and `maybe_landed` of the context.

        Args:
            ctx: newest navigation state and the setpoint flown.
            thrust: throttle given to the motor, 0..1.
        """
        p = self._parameters
        _smooth(ctx.nav, math.exp(-ctx.dt_s / p.filter_time_s), self._smoothed)
        speed, vertical_speed, airspeed, acceleration, turn_rate, sink_or_climb = self._smoothed.tolist()
        if not ctx.armed:
            # an unforced disarm happens on the ground only; a forced one in the air is gliding or falling
            moving = speed > p.horizontal_speed_max_m_s or vertical_speed > 2.0
            if self.state is LandedState.ON_GROUND or not moving:
                self._slow_s = self._contact_s = math.inf
                self.state = LandedState.ON_GROUND
            return self._store(ctx, self.state is LandedState.ON_GROUND)
        fast = speed > p.horizontal_speed_max_m_s if ctx.velocity_valid else airspeed > p.airspeed_max_m_s
        turning = turn_rate > p.rotation_max_rad_s
        vertical = ctx.altitude_valid and vertical_speed > p.vertical_speed_max_m_s
        shaken = acceleration > p.acceleration_max_m_s2
        slow = not (fast or vertical or shaken)
        if self.state is LandedState.ON_GROUND:
            # leaving: at once, but by motion only, not by being carried or turned around
            slow = not (fast or (vertical and shaken))
        elif turning:
            slow = False
        self._slow_s = self._slow_s + ctx.dt_s if slow else 0.0
        level = float(ctx.setpoint[sp.LEVEL])
        closed = level <= sp.IDLE or thrust < _IDLE_THROTTLE
        touching = closed and sink_or_climb < p.contact_speed_m_s and ctx.phase is FlightPhase.LANDING
        self._contact_s = self._contact_s + ctx.dt_s if touching else 0.0
        if self._slow_s >= p.trigger_time_s:
            self.state = LandedState.ON_GROUND
        elif ctx.phase is FlightPhase.TAKEOFF:
            self.state = LandedState.TAKEOFF
        elif ctx.phase is FlightPhase.LANDING:
            self.state = LandedState.LANDING
        else:
            self.state = LandedState.IN_AIR
        return self._store(ctx, self._contact_s >= p.contact_time_s)

    def _store(self, ctx: FlightContext, contact: bool) -> LandedState:
        landed = self.state is LandedState.ON_GROUND
        ctx.landed_state = self.state
        ctx.ground_contact = landed or contact
        ctx.maybe_landed = landed or self._slow_s >= 0.5 * self._parameters.trigger_time_s
        return self.state
