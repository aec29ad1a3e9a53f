"""A circle of a plan (NAV_LOITER_*): what it requires, and when and where it is left."""

import math
from typing import Final

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from autopilot_bridge.flight.plan_reading import Command
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.vectors import wrap_pi

_ALIGNED_RAD: Final = math.radians(8.0)
_PATIENCE_TURNS: Final = 1.25  # the course to the next place is waited for no longer
_AT_HEIGHT_M: Final = 10.0


class CircleItem:
    """One circle of a plan.

    Args:
        item: NAV_LOITER_UNLIM, _TURNS, _TIME or _TO_ALT.
        target: its centre and height, local NED, (3,).
        airspeed_m_s: NaN: the parameter's.
        parameters: radius, where the item has none.

    Attributes:
        task: flies it.
    """

    def __init__(
        self, item: MissionItem, target: Array, airspeed_m_s: float, parameters: FixedWingFlightParameters
    ) -> None:
        command = item.command
        self._turns = self._seconds = 0.0
        self._to_height = command == Command.NAV_LOITER_TO_ALT
        self._done_at_turns = math.nan
        if command == Command.NAV_LOITER_TURNS:
            self._turns = item.param1 if math.isfinite(item.param1) and item.param1 > 0.0 else 1.0
        elif command == Command.NAV_LOITER_TIME:
            self._seconds = item.param1 if math.isfinite(item.param1) else 0.0
        elif command == Command.NAV_LOITER_UNLIM:
            self._seconds = math.inf
        radius = item.param2 if self._to_height else item.param3
        wants = item.param1 if self._to_height else item.param2
        self._aligned = parameters.loiter_exits_aligned or (math.isfinite(wants) and wants > 0.0)
        self.task = LoiterTask(target, radius if math.isfinite(radius) else None, airspeed_m_s)

    @classmethod
    def to_height(
        cls, target: Array, airspeed_m_s: float, parameters: FixedWingFlightParameters
    ) -> "CircleItem":
        """Circle at a waypoint until its height is reached."""
        item = MissionItem(command=Command.NAV_LOITER_TO_ALT, param1=1.0)
        return cls(item, target, airspeed_m_s, parameters)

    def done(self, ctx: FlightContext, state: AircraftState, next_place: Array | None) -> bool:
        """One update: the circle may be left now."""
        task = self.task
        if not task.circling or not ctx.position_valid:
            return False
        if math.isnan(self._done_at_turns):
            self._seconds -= ctx.dt_s
            away_m = abs(state.down_m - float(task.centre_ned_m[2]))
            limit_m = min(_AT_HEIGHT_M, ctx.fixed_wing.acceptance_altitude_m)
            if self._seconds > 0.0 or task.turns_done < self._turns or (self._to_height and away_m > limit_m):
                return False
            self._done_at_turns = task.turns_done
        if not self._aligned or next_place is None:
            return True
        if task.turns_done - self._done_at_turns > _PATIENCE_TURNS:
            return True
        # where the course will be when the wings are level again
        rate = GRAVITY_M_S2 * math.tan(state.roll_rad) / max(state.ground_speed_m_s, 1.0)
        course = state.course_rad + rate * ctx.fixed_wing.roll_time_constant_s
        north, east = float(next_place[0]) - state.north_m, float(next_place[1]) - state.east_m
        return abs(wrap_pi(math.atan2(east, north) - course)) < _ALIGNED_RAD
