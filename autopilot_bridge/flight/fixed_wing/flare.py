"""The last seconds before the wheels touch: sink taken back, throttle off, nose onto the runway."""

from typing import Final

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.command import FlightCommand
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState

_ALIGN_M: Final = 1.0  # over the ground the crab angle is taken out
_TOUCH_M: Final = 0.15
_STILL_M_S: Final = 0.25
_STILL_S: Final = 0.6
_SHORTEST_S: Final = 1.0
_LONG_S: Final = 6.0  # a flare that lasts this long has reached a ground that lies higher than believed
_PITCH_BLEND_S: Final = 1.0
_LEAD_S: Final = 0.6
_GAIN: Final = 1.0


class Flare:
    """Sink falls with the height, from that of the slope to that of the touch.

    Attributes:
        aligning: low enough to point the nose along the runway.
    """

    __slots__ = ("_height_m", "_pitch_rad", "_sink_m_s", "_still_s", "_time_s", "aligning")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """No flare yet."""
        self.aligning = False
        self._time_s = self._still_s = 0.0
        self._height_m = 1.0
        self._sink_m_s = self._pitch_rad = 0.0

    def begin(self, state: AircraftState, height_m: float, parameters: FixedWingFlightParameters) -> None:
        """Flare from here."""
        self.reset()
        self._height_m = max(height_m, 0.1)
        self._sink_m_s = max(state.vel_down_m_s, parameters.flare_sink_m_s)
        self._pitch_rad = state.pitch_rad

    def fly(
        self,
        ctx: FlightContext,
        state: AircraftState,
        height_m: float,
        parameters: FixedWingFlightParameters,
        command: FlightCommand,
    ) -> bool:
        """Fill the longitudinal part of a command; True when the ground was touched."""
        p = parameters
        self._time_s += ctx.dt_s
        # ahead of the height by what the pitch needs to follow
        ahead_m = height_m - _LEAD_S * max(0.0, state.vel_down_m_s)
        share = min(1.0, max(0.0, ahead_m / self._height_m))
        sink = p.flare_sink_m_s + (self._sink_m_s - p.flare_sink_m_s) * share
        # what the loss of speed takes from the response is asked for on top, but never a climb
        sink -= _GAIN * (state.vel_down_m_s - sink)
        command.height_rate_m_s = -max(0.0, sink)
        command.throttle = p.throttle_idle
        # the limits of the pitch close in gradually: no jerk of the elevator
        part = min(1.0, self._time_s / _PITCH_BLEND_S)
        low = min(self._pitch_rad, p.flare_pitch_min_rad)
        high = max(self._pitch_rad, p.flare_pitch_max_rad)
        command.pitch_min_rad = low + (p.flare_pitch_min_rad - low) * part
        command.pitch_max_rad = high + (p.flare_pitch_max_rad - high) * part
        self.aligning = height_m < _ALIGN_M
        low = height_m < 2.0 * _ALIGN_M or self._time_s > _LONG_S
        still = abs(state.vel_down_m_s) < _STILL_M_S and low
        self._still_s = self._still_s + ctx.dt_s if still else 0.0
        measured = state.height_above_ground_m
        touched = p.rangefinder_landing and measured == measured and measured < _TOUCH_M
        return self._time_s > _SHORTEST_S and (touched or self._still_s > _STILL_S or ctx.ground_contact)
