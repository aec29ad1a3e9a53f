"""Nonlinear path-following guidance in wind: from a path to a course and a lateral acceleration.

The law of PX4 1.16's `DirectionalGuidance` after T. Stastny and R. Siegwart, "On Flying Backwards: Preventing
Run-away of Small, Low-speed, Fixed-wing UAVs in Strong Winds" (2019): far from the path the bearing points at
it, within a bound that grows with the ground speed it bends into the path's tangent, and the acceleration a
curved path needs is fed forward. The period is stretched where the roll response would make the loop
unstable. Turning the course into a heading in the wind is the control laws' part.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from flightsim.foundation.kernels import compiled_for, kernel

Array = NDArray[np.float64]

# Parameters of the law.
_PERIOD: Final = 0
_DAMPING: Final = 1
_SAFETY: Final = 2
_LOWER_BOUND: Final = 3  # 0: not kept
_UPPER_BOUND: Final = 4  # 0: not kept
_ROLL_TIME: Final = 5
_LAW_SIZE: Final = 6

_EPSILON: Final = 1e-6
_AIRSPEED_BUFFER_M_S: Final = 1.5  # wind this much below the airspeed begins to count as infeasible
_MIN_RADIUS_M: Final = 0.5
_SWITCH_DISTANCE_MAX_M: Final = 500.0


class PathGuidance:
    """Follows lines and circles; keeps what the last update found.

    Args:
        parameters: period, damping, roll response.

    Attributes:
        course_rad: course over ground to fly.
        lateral_acceleration_m_s2: to the right, feed-forward of the path's curvature.
        track_error_m: distance from the path, positive right of it.
        track_error_bound_m: where the bearing begins to bend into the path.
        feasibility: 1: the bearing can be flown in this wind; 0: it can't.
        period_s: the period in use.
    """

    def __init__(self, parameters: FixedWingFlightParameters) -> None:
        self._law: Array = np.zeros(_LAW_SIZE)
        self._found: Array = np.zeros(6)
        zeros = (0.0,) * 11
        self._guide = compiled_for(_guide, self._law, *zeros, self._found)
        self.set_parameters(parameters)
        self.course_rad = 0.0
        self.lateral_acceleration_m_s2 = 0.0
        self.track_error_m = 0.0
        self.feasibility = 1.0
        self.period_s = parameters.guidance_period_s
        self.track_error_bound_m = parameters.airspeed_trim_m_s * self.period_s * parameters.guidance_damping

    def set_parameters(self, parameters: FixedWingFlightParameters) -> None:
        """Fly by other parameters from now on."""
        p = parameters
        self._law[_PERIOD] = p.guidance_period_s
        self._law[_DAMPING] = p.guidance_damping
        self._law[_SAFETY] = p.guidance_period_safety
        self._law[_LOWER_BOUND] = p.guidance_period_lower_bound
        self._law[_UPPER_BOUND] = p.guidance_period_upper_bound
        self._law[_ROLL_TIME] = p.roll_time_constant_s
        self._switch_multiplier = p.switch_distance_multiplier

    @property
    def switch_distance_m(self) -> float:
        """Distance before a waypoint at which to turn to the next leg (NPFG_SW_DST_MLT)."""
        return min(_SWITCH_DISTANCE_MAX_M, self.track_error_bound_m * self._switch_multiplier)

    def follow_line(
        self, state: AircraftState, north_m: float, east_m: float, tangent_north: float, tangent_east: float
    ) -> None:
        """Follow the line through a point with a unit direction."""
        self.follow(state, north_m, east_m, tangent_north, tangent_east, 0.0)

    def follow_circle(
        self, state: AircraftState, north_m: float, east_m: float, radius_m: float, direction: float
    ) -> None:
        """Follow a circle (`radius_m` > 0); direction 1 clockwise seen from above, -1 counter-clockwise."""
        to_north, to_east = state.north_m - north_m, state.east_m - east_m
        away = math.hypot(to_north, to_east)
        if away > 0.1:
            to_north, to_east = to_north / away, to_east / away
        else:  # over the centre: go on straight ahead
            to_north, to_east = math.cos(state.course_rad), math.sin(state.course_rad)
        self.follow(
            state,
            north_m + radius_m * to_north,
            east_m + radius_m * to_east,
            -direction * to_east,
            direction * to_north,
            direction / radius_m,
        )

    def follow(
        self,
        state: AircraftState,
        north_m: float,
        east_m: float,
        tangent_north: float,
        tangent_east: float,
        curvature_1_m: float,
    ) -> None:
        """Follow a path, given by its point closest to the aircraft.

        Args:
            state: of the aircraft.
            north_m, east_m: the path's closest point.
            tangent_north, tangent_east: unit direction of the path there.
            curvature_1_m: of the path there, positive clockwise seen from above.
        """
        self._guide(
            self._law,
            state.north_m - north_m,
            state.east_m - east_m,
            state.vel_north_m_s,
            state.vel_east_m_s,
            state.ground_speed_m_s,
            state.true_airspeed_m_s,
            state.wind_north_m_s,
            state.wind_east_m_s,
            tangent_north,
            tangent_east,
            curvature_1_m,
            self._found,
        )
        (
            self.course_rad,
            self.lateral_acceleration_m_s2,
            self.track_error_m,
            self.track_error_bound_m,
            self.period_s,
            self.feasibility,
        ) = self._found.tolist()


@kernel
def _guide(
    law: Array,
    off_north: float,
    off_east: float,
    vel_north: float,
    vel_east: float,
    ground_speed: float,
    airspeed: float,
    wind_north: float,
    wind_east: float,
    tangent_north: float,
    tangent_east: float,
    curvature: float,
    found: Array,
) -> None:
    """One update of the law: `found` gets course, acceleration, track error, its bound, period, feasibility.

    Args:
        law: the parameters, in the order of `_PERIOD`, ...
        off_north, off_east: from the path's closest point to the aircraft, m.
        vel_north, vel_east, ground_speed, airspeed, wind_north, wind_east: of the aircraft, m/s.
        tangent_north, tangent_east, curvature: of the path.
        found: (6,).
    """
    airspeed = max(airspeed, _EPSILON)
    wind = math.hypot(wind_north, wind_east)
    error = tangent_north * off_east - tangent_east * off_north
    wind_cross = wind_north * tangent_east - wind_east * tangent_north
    wind_along = wind_north * tangent_north + wind_east * tangent_east
    on_track = _feasibility(wind_cross, wind_along, airspeed, wind)
    period = _adapted_period(law, ground_speed, airspeed, wind, abs(error), curvature, on_track)
    bound = _error_bound(ground_speed, period * law[_DAMPING])
    look_ahead = _look_ahead(abs(error), bound)
    # from the path's normal (towards the path) to its tangent
    side = -1.0 if error > 0.0 else 1.0
    c, s = side * math.cos(look_ahead), math.sin(look_ahead)
    bearing_north = -c * tangent_east + s * tangent_north
    bearing_east = c * tangent_north + s * tangent_east
    feasible = _feasibility(
        wind_north * bearing_east - wind_east * bearing_north,
        wind_north * bearing_north + wind_east * bearing_east,
        airspeed,
        wind,
    )
    acceleration = 0.0
    if curvature != 0.0:
        # of the parallel curve the aircraft is on
        frame = curvature / max(1.0 - curvature * error, abs(curvature) * _MIN_RADIUS_M)
        along = max(0.0, vel_north * tangent_north + vel_east * tangent_east)
        projected = math.sqrt(max(0.0, airspeed * airspeed - wind_cross * wind_cross))
        ratio = 1.0 + wind_along / max(projected, _EPSILON)
        # airspeed times speed ratio instead of ground speed: the turn is flown relative to the air
        acceleration = airspeed * s * s * feasible * ratio * frame * along
    found[0] = math.atan2(bearing_east, bearing_north)
    found[1] = acceleration
    found[2] = error
    found[3] = bound
    found[4] = period
    found[5] = feasible


@kernel
def _adapted_period(
    law: Array,
    ground_speed: float,
    airspeed: float,
    wind: float,
    error: float,
    curvature: float,
    on_track: float,
) -> float:
    """The nominal period, not below what the roll response allows, not above what the curve in the wind
    commands.
    """
    period, damping, roll_time = law[_PERIOD], law[_DAMPING], law[_ROLL_TIME]
    if law[_LOWER_BOUND] == 0.0:
        return period
    turn_rate = abs(curvature * airspeed)
    wind_factor = 2.0 * (1.0 - math.sqrt(1.0 - min(1.0, wind / airspeed)))
    straight = math.pi * roll_time / damping
    curved = straight
    windy_curve = turn_rate * wind_factor > _EPSILON
    if windy_curve and damping >= 0.5:
        curved = 4.0 * math.pi * roll_time * damping * on_track + (1.0 - on_track) * straight
    straight *= law[_SAFETY]
    curved *= law[_SAFETY]
    sine = math.sin(_look_ahead(error, _error_bound(ground_speed, straight * damping)))
    proximity = sine * sine
    lowest = curved * proximity + straight * (1.0 - proximity)
    period = max(period, lowest)
    if law[_UPPER_BOUND] != 0.0 and windy_curve and on_track > _EPSILON:
        highest = 4.0 * math.pi * damping / (turn_rate * wind_factor * on_track)
        if period > highest:
            period = max(lowest, highest) * proximity + (1.0 - proximity) * period
    return period


@kernel
def _error_bound(ground_speed_m_s: float, time_constant_s: float) -> float:
    """Track error at which the bearing is square to the path; grows with the speed over ground."""
    if ground_speed_m_s > 1.0:
        return ground_speed_m_s * time_constant_s
    return 0.5 * time_constant_s * (ground_speed_m_s * ground_speed_m_s + 1.0)


@kernel
def _look_ahead(error_m: float, bound_m: float) -> float:
    """Angle of the bearing off the path's normal: 0 far away, pi/2 (along the path) on it."""
    share = min(1.0, error_m / bound_m) - 1.0
    return 0.5 * math.pi * share * share


@kernel
def _feasibility(wind_cross: float, wind_along: float, airspeed: float, wind: float) -> float:
    """1 where a bearing can be held with room to spare, 0 where the wind across (or against) is too much."""
    across = wind if wind_along < 0.0 else abs(wind_cross)
    if airspeed - across >= _AIRSPEED_BUFFER_M_S:
        return 1.0
    share = max(0.0, (airspeed - across) / _AIRSPEED_BUFFER_M_S)
    sine = math.sin(0.5 * math.pi * share)
    return sine * sine
