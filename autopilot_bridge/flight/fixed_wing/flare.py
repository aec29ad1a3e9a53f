"""The last seconds before the wheels touch: sink taken back, airspeed held, nose onto the runway.

The flare is a path in height over the distance to go: from the slope's sink to that of the touch, falling
linearly with the height. Height errors are flown out along it, so that turbulence moves the touch little;
without a position the sink follows the height alone. The pitch has nothing to do with the airspeed here
(`control.fixed_wing.vertical_speed`), so the throttle holds it until the wheels touch: with the throttle
closed a head wind that dies at the last moment would let the aircraft fall. Which airspeed counts, in a wind
that fades towards the ground, is in `surface_wind`.
"""

import math
from typing import Final

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.command import FlightCommand
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from autopilot_bridge.flight.fixed_wing.surface_wind import SurfaceWind

_ALIGN_M: Final = 1.0  # over the ground the crab angle is taken out
_TOUCH_M: Final = 0.12
_TOUCH_S: Final = 0.1  # so long that near: one gust less than a wheel's height over the ground is no touch
_STILL_M_S: Final = 0.25
_STILL_S: Final = 0.6
_STILL_M: Final = 0.5  # by the rangefinder, whose ground may be grass
_SHORTEST_S: Final = 1.0
_LONG_S: Final = 6.0  # a flare that lasts this long has reached a ground that lies higher than believed
_PITCH_BLEND_S: Final = 1.0
_PITCH_FREE_M: Final = 0.4  # over the ground a gust may still ask for a lower nose than the flare's,
_PITCH_FREE_RAD_M: Final = math.radians(3.0)  # the lower the higher it is
_HEIGHT_GAIN: Final = 0.5  # over the time constant of the pitch
_LEAD: Final = 1.2  # time constants of the pitch: so long it needs to follow
_FIRMEST_M_S: Final = 0.6  # over the sink of the touch, at the ground; more higher up:
_FIRMER_1_S: Final = 0.5
_LATE_1_S: Final = 0.06  # added to the sink of the touch for every metre flown beyond the place, ...
_LATE_M_S: Final = 0.8  # ... at most this (ArduPilot: TECS_LAND_SRC)
_SOFTEST: Final = 0.5  # of the sink of the touch: so low over the path
_AIRSPEED_SHARE: Final = 0.94  # of the approach's airspeed, held in the flare; head wind adds to it:
_HEAD_WIND_SHARE: Final = 0.25  # of what there is of it at the touch (ArduPlane: LAND_WIND_COMP, half of it)
_POWER_SHARE: Final = 0.6  # of the trim throttle flies the glide slope about
_POWER_GAIN: Final = 3.0  # throttle per share of the airspeed that is missing


def flare_time(height_m: float, start_m: float, before_m_s: float, after_m_s: float) -> float:
    """Time from a height to the ground of a flare that starts at `start_m` with the sink `before_m_s`."""
    change = before_m_s - after_m_s
    if change < 1e-3:
        return height_m / after_m_s
    sink = after_m_s + change * height_m / start_m
    return start_m / change * math.log(sink / after_m_s)


def flare_height(time_s: float, start_m: float, before_m_s: float, after_m_s: float) -> float:
    """Height at a time before the touch: the inverse of `flare_time`."""
    change = before_m_s - after_m_s
    if change < 1e-3:
        return after_m_s * time_s
    return start_m * after_m_s / change * math.expm1(change * time_s / start_m)


def power(known_m_s: float, airspeed_m_s: float, parameters: FixedWingFlightParameters) -> float:
    """Throttle that holds an airspeed close to the ground; idle without an engine or a known airspeed.

    Args:
        known_m_s: what can be counted on (`SurfaceWind.airspeed_m_s`): an engine that idles in a gust from
            ahead lets the aircraft fall when it ends.
        airspeed_m_s: to hold.
    """
    p = parameters
    if not (p.trim_throttle > 0.0 and known_m_s == known_m_s):
        return p.throttle_idle
    missing = (airspeed_m_s - known_m_s) / airspeed_m_s
    return min(1.0, max(p.throttle_idle, _POWER_SHARE * p.trim_throttle + _POWER_GAIN * missing))


def flare_airspeed(head_wind_m_s: float, parameters: FixedWingFlightParameters) -> float:
    """Airspeed to hold in the flare: less than the approach's, by a share of the head wind less so."""
    approach = parameters.landing_airspeed_m_s
    return min(approach, _AIRSPEED_SHARE * approach + _HEAD_WIND_SHARE * max(0.0, head_wind_m_s))


class Flare:
    """Flies the flare.

    Attributes:
        aligning: low enough to point the nose along the runway.
    """

    __slots__ = ("_height_m", "_pitch_rad", "_sink_m_s", "_still_s", "_time_s", "_touching_s", "aligning")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """No flare yet."""
        self.aligning = False
        self._time_s = self._still_s = self._touching_s = 0.0
        self._height_m = 1.0
        self._sink_m_s = self._pitch_rad = 0.0

    def touch_beyond_m(
        self, state: AircraftState, height_m: float, to_go_m: float, parameters: FixedWingFlightParameters
    ) -> float:
        """How far beyond the place (negative: before it) the wheels touch at the firmest sink from now on."""
        firmest_m_s = parameters.flare_sink_m_s + _FIRMEST_M_S
        height_m = max(height_m, 0.0)
        time_s = flare_time(height_m, height_m, firmest_m_s + _FIRMER_1_S * height_m, firmest_m_s)
        return state.ground_speed_m_s * time_s - to_go_m

    def begin(
        self, state: AircraftState, height_m: float, sink_m_s: float, parameters: FixedWingFlightParameters
    ) -> None:
        """Flare from here; `height_m` and `sink_m_s` are those the path was planned with."""
        self.reset()
        self._plan(height_m, sink_m_s, parameters)
        self._pitch_rad = state.pitch_rad

    def _plan(self, height_m: float, sink_m_s: float, parameters: FixedWingFlightParameters) -> None:
        self._height_m = max(height_m, 0.1)
        self._sink_m_s = max(sink_m_s, parameters.flare_sink_m_s)

    def _sink(
        self, state: AircraftState, height_m: float, to_go_m: float, parameters: FixedWingFlightParameters
    ) -> float:
        """Sink to fly."""
        start, before = self._height_m, self._sink_m_s
        after_m_s, lead_s = parameters.flare_sink_m_s, _LEAD * parameters.pitch_time_constant_s
        if to_go_m < 0.0:
            after_m_s += min(_LATE_M_S, -_LATE_1_S * to_go_m)
            before = max(before, after_m_s)
        ahead = max(0.0, height_m - lead_s * state.vel_down_m_s)
        if to_go_m == to_go_m:
            speed = max(state.ground_speed_m_s, 1.0)
            time = max(0.0, to_go_m / speed - lead_s)
            whole = flare_time(start, start, before, after_m_s)
            path = flare_height(min(time, whole), start, before, after_m_s)
            sink = after_m_s + (before - after_m_s) * path / start
            path += before * max(0.0, time - whole)
            sink += _HEIGHT_GAIN / parameters.pitch_time_constant_s * (ahead - path)
        else:
            sink = after_m_s + (before - after_m_s) * min(1.0, ahead / start)
        return min(after_m_s + _FIRMEST_M_S + _FIRMER_1_S * ahead, max(_SOFTEST * after_m_s, sink))

    def fly_slope(
        self,
        state: AircraftState,
        height_m: float,
        to_go_m: float,
        slope: tuple[float, float],
        wind: SurfaceWind,
        parameters: FixedWingFlightParameters,
        command: FlightCommand,
    ) -> None:
        """Fill the longitudinal part of a command on the last of the glide slope, above the flare.

        Args:
            height_m: over the ground.
            to_go_m: along the runway to the place of the touch.
            slope: height of the flare that follows, m; sink of the glide slope, m/s.
            wind: close to the ground, of this update.
        """
        p = parameters
        self._plan(*slope, p)
        command.down_m = math.nan
        command.height_rate_m_s = -self._sink(state, height_m, to_go_m, p)
        command.throttle = power(wind.airspeed_m_s, p.landing_airspeed_m_s, p)

    def fly(
        self,
        ctx: FlightContext,
        state: AircraftState,
        height_m: float,
        to_go_m: float,
        wind: SurfaceWind,
        parameters: FixedWingFlightParameters,
        command: FlightCommand,
    ) -> bool:
        """Fill the longitudinal part of a command; True when the ground was touched.

        Args:
            height_m: over the ground.
            to_go_m: along the runway to the place of the touch; NaN: not known.
            wind: close to the ground, of this update.
        """
        p = parameters
        self._time_s += ctx.dt_s
        sink = self._sink(state, height_m, to_go_m, p)
        command.height_rate_m_s = -sink
        command.throttle = power(wind.airspeed_m_s, flare_airspeed(wind.head_wind_m_s, p), p)
        # the limits of the pitch close in gradually: no jerk of the elevator
        part = min(1.0, self._time_s / _PITCH_BLEND_S)
        ahead = height_m - _LEAD * p.pitch_time_constant_s * state.vel_down_m_s
        lowest = p.flare_pitch_min_rad - _PITCH_FREE_RAD_M * max(0.0, ahead - _PITCH_FREE_M)
        lowest = max(lowest, p.pitch_min_rad)
        low = min(self._pitch_rad, lowest)
        high = max(self._pitch_rad, p.flare_pitch_max_rad)
        command.pitch_min_rad = low + (lowest - low) * part
        command.pitch_max_rad = high + (p.flare_pitch_max_rad - high) * part
        self.aligning = height_m < _ALIGN_M
        return self._time_s > _SHORTEST_S and (self._touches(ctx, state, height_m, p) or ctx.ground_contact)

    def _touches(
        self,
        ctx: FlightContext,
        state: AircraftState,
        height_m: float,
        parameters: FixedWingFlightParameters,
    ) -> bool:
        near = height_m < 2.0 * _ALIGN_M or self._time_s > _LONG_S
        still = abs(state.vel_down_m_s) < _STILL_M_S and near
        measured = state.height_above_ground_m
        if parameters.rangefinder_landing and measured == measured:
            low = measured < parameters.standing_height_m + _TOUCH_M
            self._touching_s = self._touching_s + ctx.dt_s if low else 0.0
            still = still and height_m < _STILL_M
        self._still_s = self._still_s + ctx.dt_s if still else 0.0
        return self._touching_s > _TOUCH_S or self._still_s > _STILL_S
