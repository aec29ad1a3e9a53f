"""The straight line of a runway: steered along on the wheels, followed in the climb-out."""

import math
from typing import Final

from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand

_STEER_GAIN_RAD_M: Final = 0.02
_STEER_MAX_RAD: Final = math.radians(6.0)


class Line:
    """A line through a place with a direction.

    Attributes:
        heading_rad: its direction.
    """

    def __init__(self) -> None:
        self.set(0.0, 0.0, 0.0)

    def set(self, north_m: float, east_m: float, heading_rad: float) -> None:
        """The line through a place."""
        self._north_m, self._east_m = north_m, east_m
        self.heading_rad = heading_rad
        self._cos, self._sin = math.cos(heading_rad), math.sin(heading_rad)

    def begin(self, state: AircraftState, heading_rad: float) -> None:
        """The line through the aircraft."""
        self.set(state.north_m, state.east_m, heading_rad)

    @property
    def known(self) -> bool:
        """The line was laid through a known place."""
        return math.isfinite(self._north_m + self._east_m + self.heading_rad)

    def offset_m(self, state: AircraftState) -> float:
        """How far right of the line."""
        return self._cos * (state.east_m - self._east_m) - self._sin * (state.north_m - self._north_m)

    def along_m(self, state: AircraftState) -> float:
        """How far along the line, from its place."""
        return self._cos * (state.north_m - self._north_m) + self._sin * (state.east_m - self._east_m)

    def steering_heading(self, state: AircraftState, position_valid: bool) -> float:
        """Heading for the wheels that leads back onto the line."""
        if not position_valid:
            return self.heading_rad
        correction = _STEER_GAIN_RAD_M * self.offset_m(state)
        return self.heading_rad - min(_STEER_MAX_RAD, max(-_STEER_MAX_RAD, correction))

    def follow(self, state: AircraftState, guidance: PathGuidance, command: FlightCommand) -> None:
        """Fill the lateral part of a command to fly along the line."""
        guidance.follow_line(state, self._north_m, self._east_m, self._cos, self._sin)
        command.course_rad = guidance.course_rad
        command.lateral_acceleration_m_s2 = guidance.lateral_acceleration_m_s2
