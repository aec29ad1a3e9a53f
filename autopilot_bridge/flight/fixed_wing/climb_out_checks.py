"""What the motion shows in a climb-out: that the aircraft was launched, and that its engine has no power.

Sources of the launch detection: PX4's LaunchDetector, ArduPlane's automatic take-off."""

import math
from typing import Final

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from flightsim.foundation.atmosphere import GRAVITY_M_S2

_SPUN_UP_S: Final = 1.0  # an engine that idled brings nothing before
_STRETCH_S: Final = 1.5  # one gust doesn't outweigh it


class PowerCheck:
    """Looks at the energy of one stretch of the climb after the other.

    Height and speed over ground count: a gust changes the airspeed at once, and these only by its force.
    """

    def __init__(self) -> None:
        self._left_s = 0.0
        self._start_m = 0.0

    def begin(self) -> None:
        """Full throttle from now on."""
        self._left_s = _SPUN_UP_S
        self._start_m = -math.inf

    def powerless(self, state: AircraftState, dt_s: float) -> bool:
        """True at the end of a stretch over which the energy fell.

        Args:
            state: at the end of this update.
            dt_s: since the update before.
        """
        self._left_s -= dt_s
        if self._left_s > 0.0:
            return False
        energy_m = _energy_height_m(state)
        fell = energy_m < self._start_m
        self._left_s, self._start_m = _STRETCH_S, energy_m
        return fell


def _energy_height_m(state: AircraftState) -> float:
    speed_squared = state.ground_speed_m_s**2 + state.vel_down_m_s**2
    return speed_squared / (2.0 * GRAVITY_M_S2) - state.down_m


_FLYING_SHARE = 0.7  # of the lowest airspeed: at this speed it flies, whatever the accelerometer felt


class LaunchDetector:
    """Watches the acceleration along the body's x axis for longer than a given time, and the speed.

    Attributes:
        launched: the launch was felt.
        since_launch_s: since then; kept by the task.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Wait for a launch."""
        self._felt_s = 0.0
        self.launched = False
        self.since_launch_s = 0.0

    def update(self, ctx: FlightContext, state: AircraftState, parameters: FixedWingFlightParameters) -> bool:
        """One update; True from the launch on."""
        p = parameters
        if self.launched:
            return True
        if state.forward_force_m_s2 >= p.launch_acceleration_m_s2:
            self._felt_s += ctx.dt_s
        else:
            self._felt_s = 0.0
        fast = state.ground_speed_m_s >= p.launch_speed_min_m_s
        felt = self._felt_s > p.launch_time_s and fast
        flies = state.ground_speed_m_s > _FLYING_SHARE * p.airspeed_min_m_s and ctx.velocity_valid
        self.launched = felt or flies
        return self.launched
