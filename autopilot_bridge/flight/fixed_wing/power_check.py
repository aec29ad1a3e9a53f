"""Whether the engine does its work: in a climb at full throttle the energy rises, or there is no power."""

import math
from typing import Final

from autopilot_bridge.flight.fixed_wing.state import AircraftState
from flightsim.foundation.atmosphere import GRAVITY_M_S2

_SPUN_UP_S: Final = 1.0  # an engine that idled brings nothing before
_STRETCH_S: Final = 1.5  # one gust doesn't outweigh it


class PowerCheck:
    """Looks at the energy of one stretch of the climb after the other.

    Height and speed over ground count: a gust changes the airspeed at once, and these only by its force.
    """

    __slots__ = ("_left_s", "_start_m")

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
