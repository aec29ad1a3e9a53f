"""A circle flown around a place: reached along its tangent, captured, turns counted."""

import math
from typing import Final

from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from flightsim.foundation.vectors import wrap_pi

_TANGENT_BEYOND: Final = 1.3  # radii: closer than this the circle is captured without a tangent leg
_NEAR_CIRCLE: Final = 0.15  # of the radius: the circle counts as captured
_NEAR_CIRCLE_MIN_M: Final = 10.0
_ALONG_CIRCLE_RAD: Final = math.radians(35.0)
_RETANGENT: Final = 1.8  # radii: blown this far off the circle, fly back along a tangent


class Circle:
    """A circle and where the aircraft is on it.

    Args:
        north_m, east_m: centre.
        radius_m: positive clockwise seen from above, negative counter-clockwise.

    Attributes:
        north_m, east_m, radius_m: as given, radius without its sign.
        direction: 1 clockwise, -1 counter-clockwise.
        circling: the circle is captured.
        turns: flown since then.
    """

    def __init__(self, north_m: float, east_m: float, radius_m: float) -> None:
        self.north_m = north_m
        self.east_m = east_m
        self.radius_m = abs(radius_m)
        self.direction = -1.0 if radius_m < 0.0 else 1.0
        self.circling = False
        self.turns = 0.0
        self._phase_rad = 0.0
        self._on_tangent = False
        self._line_north_m = self._line_east_m = 0.0
        self._tangent_north = self._tangent_east = 0.0

    def begin(self, state: AircraftState) -> None:
        """Set out for the circle from here."""
        self.circling = False
        self.turns = 0.0
        self._set_tangent(state)

    def _set_tangent(self, state: AircraftState) -> None:
        """The straight leg to the circle, where it is worth one."""
        north, east = self.north_m - state.north_m, self.east_m - state.east_m
        away = math.hypot(north, east)
        self._on_tangent = away > _TANGENT_BEYOND * self.radius_m
        if not self._on_tangent:
            return
        # clockwise passes with the centre on the right, that is left of the straight way to it
        bearing = math.atan2(east, north) - self.direction * math.asin(self.radius_m / away)
        self._line_north_m, self._line_east_m = state.north_m, state.east_m
        self._tangent_north, self._tangent_east = math.cos(bearing), math.sin(bearing)

    def follow(self, state: AircraftState, guidance: PathGuidance, roll_in_s: float) -> None:
        """One update of the guidance; `roll_in_s`: the turn begins so long before the tangent point."""
        north, east = state.north_m - self.north_m, state.east_m - self.east_m
        away = math.hypot(north, east)
        if self._on_tangent:
            # distance to go to the foot of the centre on the line
            ahead = -(north * self._tangent_north + east * self._tangent_east)
            if ahead <= state.ground_speed_m_s * roll_in_s:
                self._on_tangent = False
        elif away > _RETANGENT * self.radius_m and away - self.radius_m > guidance.track_error_bound_m:
            self._set_tangent(state)
        if self._on_tangent:
            guidance.follow_line(
                state, self._line_north_m, self._line_east_m, self._tangent_north, self._tangent_east
            )
            return
        guidance.follow_circle(state, self.north_m, self.east_m, self.radius_m, self.direction)
        self._count(state, north, east, away)

    def _count(self, state: AircraftState, north: float, east: float, away: float) -> None:
        phase = math.atan2(east, north)
        if self.circling:
            step = self.direction * wrap_pi(phase - self._phase_rad)
            self.turns += step / (2.0 * math.pi)
        else:
            near = abs(away - self.radius_m) < max(_NEAR_CIRCLE * self.radius_m, _NEAR_CIRCLE_MIN_M)
            tangent = phase + self.direction * 0.5 * math.pi
            self.circling = near and abs(wrap_pi(state.course_rad - tangent)) < _ALONG_CIRCLE_RAD
        self._phase_rad = phase
