"""The airspeed that is to be expected close to the ground, where the wind fades.

The navigation filter's wind is steady: it takes a change for a gust, and has still the wind of the approach
when the wheels touch. Over the last 30 m of height wind over open ground loses more than half of its speed.
Airspeed by the filter's wind is then wrong by 3 m/s in 6 m/s of wind: too high against it, so that a gust
from ahead closes the throttle, too low with it, so that the throttle opens for a lull that isn't one.

The wind assumed here follows the logarithmic law of the surface layer (MIL-F-8785C, paragraph 3.7.3.2). The
airspeed measured over the last seconds corrects it where the ground is rougher, or where the wind does not
fade.
"""

import math

from autopilot_bridge.flight.fixed_wing.landing_parameters import SurfaceWindParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState


def wind_share(height_m: float, known_at_m: float, parameters: SurfaceWindParameters) -> float:
    """Wind at a height over the ground, over the wind at the height where it is known; 0 to 1."""
    roughness_m = parameters.roughness_m
    if height_m <= roughness_m:
        return 0.0
    known_at_m = max(known_at_m, parameters.lowest_known_m)
    return min(1.0, math.log(height_m / roughness_m) / math.log(known_at_m / roughness_m))


class SurfaceWind:
    """Airspeed in the wind close to the ground, gusts left out.

    Attributes:
        airspeed_m_s: equivalent airspeed to count on shortly: the lower of the one measured and the one in
            the wind without gusts, both with what the fading wind will have changed; NaN when not known.
        head_wind_m_s: from ahead just before the touch; negative: from behind; 0 while no wind is known.
    """

    def __init__(self) -> None:
        self.reset(math.inf, SurfaceWindParameters())

    def reset(self, known_at_m: float, parameters: SurfaceWindParameters) -> None:
        """An approach begins at a height over the ground; the filter's wind is the one there."""
        self._p = parameters
        self._known_at_m = min(known_at_m, parameters.known_at_m)
        self._correction_m_s = 0.0
        self.airspeed_m_s = math.nan
        self.head_wind_m_s = 0.0

    def update(
        self, state: AircraftState, height_m: float, standing_height_m: float, dt_s: float, *, measured: bool
    ) -> None:
        """Take the newest state.

        Args:
            height_m: of the wheels over the ground.
            standing_height_m: of the aircraft when its wheels touch.
            measured: the airspeed is a sensor's. One that was made up of ground speed and the filter's wind
                says nothing of the wind down here.
        """
        steady = state.lasting_airspeed_m_s
        if not (state.airspeed_m_s == state.airspeed_m_s and steady == steady):  # no airspeed, or no wind
            self.airspeed_m_s = state.airspeed_m_s
            self.head_wind_m_s = 0.0
            return
        height_m = max(self._p.lowest_m, height_m)
        at_touch = self._share(self._p.lowest_m + standing_height_m)
        here = self._airspeed(state, self._share(height_m + standing_height_m))
        later_m = max(self._p.lowest_m, height_m - self._p.ahead_s * max(0.0, state.vel_down_m_s))
        ahead = self._airspeed(state, self._share(later_m + standing_height_m))
        along_m_s = state.vel_north_m_s * state.wind_north_m_s + state.vel_east_m_s * state.wind_east_m_s
        self.head_wind_m_s = -at_touch * along_m_s / max(state.ground_speed_m_s, 1.0)
        if not measured:
            self._correction_m_s = 0.0
            self.airspeed_m_s = min(steady, ahead)
            return
        difference = state.airspeed_m_s - here - self._correction_m_s
        self._correction_m_s += min(1.0, dt_s / self._p.corrected_s) * difference
        self.airspeed_m_s = min(state.airspeed_m_s + ahead - here, ahead + self._correction_m_s)

    def _share(self, height_m: float) -> float:
        return wind_share(height_m, self._known_at_m, self._p)

    @staticmethod
    def _airspeed(state: AircraftState, share: float) -> float:
        """Equivalent airspeed in a share of the filter's wind."""
        true_m_s = math.hypot(
            state.vel_north_m_s - share * state.wind_north_m_s,
            state.vel_east_m_s - share * state.wind_east_m_s,
        )
        return true_m_s * state.lasting_airspeed_m_s / max(state.true_airspeed_m_s, 1.0)
