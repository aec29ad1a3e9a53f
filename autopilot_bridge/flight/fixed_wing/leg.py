"""A leg to a waypoint: its line, its height profile, and when the waypoint is reached."""

import math
from typing import Final

from autopilot_bridge.flight.fixed_wing.line import Line
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters, TurnInRule
from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.vectors import Vector, wrap_pi

_TURN_BANK_RAD: Final = math.radians(30.0)  # of the turn towards a waypoint beside the aircraft
_RIGHT_ANGLE_RAD: Final = 0.5 * math.pi
_SAME_PLACE_M: Final = 1.0
_SLOPE_LONGER_THAN_M: Final = 20.0


class Leg:
    """From a place to a waypoint, local NED.

    Args:
        start: where the line begins.
        target: the waypoint.
        ramps: the height goes evenly from the start's to the target's; False: to the target's at once.
        radius_m: acceptance radius.
        turn_rad: change of course behind the waypoint, 0..pi; NaN: not known, or of no matter.
        to_the_end: no turn begins before the waypoint is passed.
    """

    def __init__(
        self,
        start: Vector,
        target: Vector,
        *,
        ramps: bool,
        radius_m: float,
        turn_rad: float,
        to_the_end: bool = False,
    ) -> None:
        self.target = target
        self.radius_m = radius_m
        self._turn_rad = turn_rad
        self._to_the_end = to_the_end
        self._ramps = ramps
        self._direct = not ramps
        self._start_down_m = start[2]
        self._turn_side = 0.0
        self._line = Line()
        self._set_line(start)

    def _set_line(self, start: Vector) -> None:
        north, east = self.target[0] - start[0], self.target[1] - start[1]
        self.length_m = math.hypot(north, east)
        self.course_rad = math.atan2(east, north)
        self._line.set(start[0], start[1], self.course_rad)

    @property
    def too_short(self) -> bool:
        """Start and target are one place: there is no line."""
        return self.length_m < _SAME_PLACE_M

    def turn_from(self, course_rad: float) -> None:
        """The leg begins with a turn from a course: the shorter way round to its own."""
        self._turn_side = math.copysign(1.0, wrap_pi(self.course_rad - course_rad))

    def start_again(self, state: AircraftState) -> None:
        """The waypoint was missed: straight to it from here."""
        self._ramps = False
        self._direct = True
        self._set_line((state.north_m, state.east_m, state.down_m))

    def follow(self, state: AircraftState, guidance: PathGuidance, command: FlightCommand) -> None:
        """Fill course and height of a command."""
        command.down_m = self.target[2]
        if self._direct and self._inside_turn(state):
            # turning towards it would circle around it for ever: away from it first
            command.course_rad = state.course_rad
            self._set_line((state.north_m, state.east_m, state.down_m))
            return
        self._line.follow(state, guidance, command)
        self._hold_turn(state, command)
        climb = self._start_down_m - self.target[2]
        # the height is there when the turn begins
        length = self.length_m - self.radius_m
        if not self._ramps or length < _SLOPE_LONGER_THAN_M or climb == 0.0:
            return
        share = self._line.along_m(state) / length
        if share < 1.0:
            command.down_m = self._start_down_m - max(0.0, share) * climb
            command.height_rate_m_s = climb / length * state.ground_speed_m_s

    def _hold_turn(self, state: AircraftState, command: FlightCommand) -> None:
        """Turning back, the way to the line is about as far round to either side, and a gust decides: the
        corner's own way round is kept to, until less than a right angle is left (ArduPlane's L1 prevents
        such indecision too).
        """
        if self._turn_side == 0.0:
            return
        left = wrap_pi(command.course_rad - state.course_rad)
        if abs(left) <= _RIGHT_ANGLE_RAD:
            self._turn_side = 0.0
        elif left * self._turn_side < 0.0:
            command.course_rad = wrap_pi(state.course_rad + self._turn_side * _RIGHT_ANGLE_RAD)

    def _inside_turn(self, state: AircraftState) -> bool:
        """The waypoint is so near and so far aside that no turn from here leads over it."""
        north, east = self.target[0] - state.north_m, self.target[1] - state.east_m
        speed = state.ground_speed_m_s
        turn_m = speed * speed / (GRAVITY_M_S2 * math.tan(_TURN_BANK_RAD))
        if north * north + east * east > 4.0 * turn_m * turn_m or speed < 1.0:
            return False
        right = (state.vel_north_m_s * east - state.vel_east_m_s * north) / speed
        ahead = (state.vel_north_m_s * north + state.vel_east_m_s * east) / speed
        return math.hypot(ahead, abs(right) - turn_m) < turn_m - 0.5 * self.radius_m

    def away_m(self, state: AircraftState) -> float:
        """Horizontal distance to the waypoint."""
        return math.hypot(self.target[0] - state.north_m, self.target[1] - state.east_m)

    def passed(self, state: AircraftState) -> bool:
        """Beside the waypoint, or beyond it."""
        return self._line.along_m(state) >= self.length_m

    def turn_in_m(self, guidance: PathGuidance, parameters: FixedWingFlightParameters) -> float:
        """Distance to the waypoint at which it counts as reached."""
        if self._to_the_end:
            return 0.0
        if parameters.turn_in is TurnInRule.SWITCH_DISTANCE:
            return max(self.radius_m, guidance.switch_distance_m)
        if math.isnan(self._turn_rad):
            return self.radius_m
        return self.radius_m * min(1.0, self._turn_rad / (0.5 * math.pi))
