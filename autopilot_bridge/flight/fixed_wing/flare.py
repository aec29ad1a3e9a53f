"""The last seconds before the wheels touch: sink taken back, airspeed held, nose onto the runway.

The flare is a path in height over the distance to go: from the slope's sink to that of the touch, falling
linearly with the height. Height errors are flown out along it, so that turbulence moves the touch little;
without a position the sink follows the height alone. The pitch has nothing to do with the airspeed here
(`control.fixed_wing.vertical`), so the throttle holds it until the wheels touch: with the throttle
closed a head wind that dies at the last moment would let the aircraft fall. Which airspeed counts, in a wind
that fades towards the ground, is in `surface_wind`.
"""

import math

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand
from autopilot_bridge.flight.fixed_wing.surface_wind import SurfaceWind


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
    p, flare = parameters, parameters.flare
    if not (p.trim_throttle > 0.0 and known_m_s == known_m_s):
        return p.throttle_idle
    missing = (airspeed_m_s - known_m_s) / airspeed_m_s
    return min(1.0, max(p.throttle_idle, flare.power_share * p.trim_throttle + flare.power_gain * missing))


def flare_airspeed(head_wind_m_s: float, parameters: FixedWingFlightParameters) -> float:
    """Airspeed to hold in the flare: less than the approach's, by a share of the head wind less so."""
    approach, flare = parameters.landing_airspeed_m_s, parameters.flare
    return min(approach, flare.airspeed_share * approach + flare.head_wind_share * max(0.0, head_wind_m_s))


class Flare:
    """Flies the flare.

    Attributes:
        aligning: low enough to point the nose along the runway.
    """

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
        flare = parameters.flare
        firmest_m_s = parameters.flare_sink_m_s + flare.firmest_m_s
        height_m = max(height_m, 0.0)
        time_s = flare_time(height_m, height_m, firmest_m_s + flare.firmer_1_s * height_m, firmest_m_s)
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
        flare, start, before = parameters.flare, self._height_m, self._sink_m_s
        after_m_s, lead_s = parameters.flare_sink_m_s, flare.lead * parameters.pitch_time_constant_s
        if to_go_m < 0.0:
            after_m_s += min(flare.late_m_s, -flare.late_1_s * to_go_m)
            before = max(before, after_m_s)
        ahead = max(0.0, height_m - lead_s * state.vel_down_m_s)
        if to_go_m == to_go_m:
            speed = max(state.ground_speed_m_s, 1.0)
            time = max(0.0, to_go_m / speed - lead_s)
            whole = flare_time(start, start, before, after_m_s)
            path = flare_height(min(time, whole), start, before, after_m_s)
            sink = after_m_s + (before - after_m_s) * path / start
            path += before * max(0.0, time - whole)
            sink += flare.height_gain / parameters.pitch_time_constant_s * (ahead - path)
        else:
            sink = after_m_s + (before - after_m_s) * min(1.0, ahead / start)
        return min(
            after_m_s + flare.firmest_m_s + flare.firmer_1_s * ahead,
            max(flare.softest_share * after_m_s, sink),
        )

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
        p, flare = parameters, parameters.flare
        self._time_s += ctx.dt_s
        sink = self._sink(state, height_m, to_go_m, p)
        command.height_rate_m_s = -sink
        command.throttle = power(wind.airspeed_m_s, flare_airspeed(wind.head_wind_m_s, p), p)
        # the limits of the pitch close in gradually: no jerk of the elevator
        part = min(1.0, self._time_s / flare.pitch_blend_s)
        ahead = height_m - flare.lead * p.pitch_time_constant_s * state.vel_down_m_s
        lowest = p.flare_pitch_min_rad - flare.pitch_free_rad_m * max(0.0, ahead - flare.pitch_free_m)
        lowest = max(lowest, p.pitch_min_rad)
        low = min(self._pitch_rad, lowest)
        high = max(self._pitch_rad, p.flare_pitch_max_rad)
        command.pitch_min_rad = low + (lowest - low) * part
        command.pitch_max_rad = high + (p.flare_pitch_max_rad - high) * part
        self.aligning = height_m < flare.align_m
        return self._time_s > flare.shortest_s and (
            self._touches(ctx, state, height_m, p) or ctx.ground_contact
        )

    def _touches(
        self, ctx: FlightContext, state: AircraftState, height_m: float, parameters: FixedWingFlightParameters
    ) -> bool:
        flare = parameters.flare
        near = height_m < 2.0 * flare.align_m or self._time_s > flare.long_s
        still = abs(state.vel_down_m_s) < flare.still_m_s and near
        measured = state.height_above_ground_m
        if parameters.rangefinder_landing and measured == measured:
            low = measured < parameters.standing_height_m + flare.touch_m
            self._touching_s = self._touching_s + ctx.dt_s if low else 0.0
            still = still and height_m < flare.still_m
        self._still_s = self._still_s + ctx.dt_s if still else 0.0
        return self._touching_s > flare.touch_s or self._still_s > flare.still_s
