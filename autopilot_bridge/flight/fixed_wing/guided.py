"""Targets from outside, as ArduPlane's GUIDED flies them.

A place is circled. Over that lie what GUIDED_CHANGE_HEADING, _ALTITUDE and _SPEED ask for, until the next
place, and over all SET_ATTITUDE_TARGET for 3 s after the newest of each of its parts.
"""

import math
from typing import Final

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.fixed_wing.base import AircraftTask
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.task import AnyVector, GuidedKind, SpeedKind, TaskStatus
from flightsim.foundation.atmosphere import GRAVITY_M_S2

_NEVER: Final = math.inf


class GuidedTask(AircraftTask):
    """Places, headings, altitudes, airspeeds and attitudes. On the ground nothing moves.

    Attributes:
        kind: what is being flown: HOLD (circling here), POSITION, HEADING or ATTITUDE.
    """

    def __init__(self) -> None:
        super().__init__()
        self.kind = GuidedKind.HOLD
        self._loiter = LoiterTask()
        self._loiter_started = False
        self._place_given = False
        self._airspeed_m_s = math.nan
        self._airspeed_target_m_s = math.nan
        self._airspeed_acceleration_m_s2 = 0.0
        self._forget_overrides()

    def _forget_overrides(self) -> None:
        self._heading_rad = math.nan
        self._course = False
        self._bank_limit_rad = math.nan
        self._altitude_target_down_m = math.nan
        self._altitude_rate_m_s = 0.0
        self._roll_rad = self._pitch_rad = self._throttle = 0.0
        self._roll_age_s = self._pitch_age_s = self._throttle_age_s = _NEVER

    def set_hold(self, ctx: FlightContext) -> None:
        """Circle here, at this height and the parameters' airspeed (GUIDED is entered)."""
        self._forget_overrides()
        self._airspeed_m_s = self._airspeed_target_m_s = math.nan
        self._loiter = LoiterTask()
        self._loiter_started = self._place_given = False
        self.kind = GuidedKind.HOLD

    def set_position(
        self,
        ctx: FlightContext,
        position_ned_m: AnyVector,
        radius_m: float | None = None,
        airspeed_m_s: float | None = None,
    ) -> None:
        """Fly to a place and circle it.

        NaN components: keep the present ones. A radius is positive clockwise; None: the parameter's.
        """
        target: Array = np.array(position_ned_m, dtype=np.float64)
        if airspeed_m_s is not None and math.isfinite(airspeed_m_s) and airspeed_m_s > 0.0:
            self.set_airspeed(ctx, airspeed_m_s, 0.0)
        self._forget_overrides()
        self._loiter = LoiterTask(target, radius_m, glides=True)
        self._loiter_started = False
        self._place_given = True
        self.kind = GuidedKind.POSITION

    def set_heading(
        self, ctx: FlightContext, heading_rad: float, course: bool, acceleration_m_s2: float
    ) -> None:
        """Fly straight on in a direction, over ground (`course`) or of the nose, from now on.

        The lateral acceleration limits the bank on the way to it.
        """
        self._heading_rad = heading_rad
        self._course = course
        self._bank_limit_rad = math.atan(max(0.0, acceleration_m_s2) / GRAVITY_M_S2)
        self.kind = GuidedKind.HEADING

    def set_altitude(self, ctx: FlightContext, down_m: float, rate_m_s: float) -> None:
        """Fly at another height.

        With a rate, the target of each update is one step of it away from the present height, so that the
        aircraft crawls, as ArduPlane does; 0: at once.
        """
        self._altitude_target_down_m = down_m
        self._altitude_rate_m_s = max(0.0, rate_m_s)

    def set_airspeed(self, ctx: FlightContext, airspeed_m_s: float, acceleration_m_s2: float) -> None:
        """Fly at another equivalent airspeed, reached at an acceleration (0: at once)."""
        p = ctx.fixed_wing
        self._airspeed_target_m_s = min(p.airspeed_max_m_s, max(p.airspeed_min_m_s, airspeed_m_s))
        self._airspeed_acceleration_m_s2 = max(0.0, acceleration_m_s2)
        if not math.isfinite(self._airspeed_m_s):
            measured = float(self._state.airspeed_m_s)
            self._airspeed_m_s = (
                measured if math.isfinite(measured) and measured > 0.0 else p.airspeed_trim_m_s
            )
        if self._airspeed_acceleration_m_s2 == 0.0:
            self._airspeed_m_s = self._airspeed_target_m_s

    def set_attitude(
        self, ctx: FlightContext, roll_rad: float | None, pitch_rad: float | None, throttle: float | None
    ) -> None:
        """Fly an attitude until the time-out; None: left to the autopilot (its own time-out goes on)."""
        if roll_rad is not None:
            self._roll_rad, self._roll_age_s = roll_rad, 0.0
        if pitch_rad is not None:
            self._pitch_rad, self._pitch_age_s = pitch_rad, 0.0
        if throttle is not None:
            self._throttle, self._throttle_age_s = min(1.0, max(0.0, throttle)), 0.0
        self.kind = GuidedKind.ATTITUDE

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """DO_CHANGE_SPEED: what GUIDED_CHANGE_SPEED has set goes over it."""
        self._loiter.change_speed(ctx, kind, speed_m_s)

    @property
    def circle(self) -> LoiterTask | None:
        """The circle being flown, or None."""
        return self._loiter if self.kind in (GuidedKind.HOLD, GuidedKind.POSITION) else None

    def _begin(self, ctx: FlightContext) -> None:
        self._loiter_started = False

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        if not self._loiter_started:
            self._loiter.activate(ctx)
            self._loiter_started = True
        timeout = ctx.fixed_wing.guided_timeout_s
        self._roll_age_s += ctx.dt_s
        self._pitch_age_s += ctx.dt_s
        self._throttle_age_s += ctx.dt_s
        roll = self._roll_age_s <= timeout
        pitch = self._pitch_age_s <= timeout
        throttle = self._throttle_age_s <= timeout
        self.kind = self._flown(roll or pitch or throttle)
        # the circle goes on below whatever lies over it
        command = self._loiter.guide(ctx)
        if math.isfinite(self._heading_rad):
            command.clear_lateral()
            if self._course:
                command.course_rad = self._heading_rad
            else:
                command.heading_rad = self._heading_rad
            command.roll_limit_rad = min(self._bank_limit_rad, ctx.fixed_wing.bank_max_rad)
        self._fly_altitude(ctx, command.down_m)
        self._fly_airspeed(ctx)
        if roll:
            limit = ctx.fixed_wing.bank_max_rad
            command.clear_lateral()
            command.roll_rad = min(limit, max(-limit, self._roll_rad))
        if pitch:
            command.pitch_rad = min(
                ctx.fixed_wing.pitch_max_rad, max(ctx.fixed_wing.pitch_min_rad, self._pitch_rad)
            )
        if throttle:
            command.throttle = self._throttle
        command.write(ctx)
        return TaskStatus.RUNNING

    def _flown(self, attitude: bool) -> GuidedKind:
        if attitude:
            return GuidedKind.ATTITUDE
        if math.isfinite(self._heading_rad):
            return GuidedKind.HEADING
        return GuidedKind.POSITION if self._place_given else GuidedKind.HOLD

    def _fly_altitude(self, ctx: FlightContext, circle_down_m: float) -> None:
        target = self._altitude_target_down_m
        if target != target or circle_down_m != circle_down_m:
            return
        if self._altitude_rate_m_s > 0.0:
            down = self._state.down_m
            step = self._altitude_rate_m_s * ctx.dt_s
            target = down + min(step, max(-step, target - down))
        self._loiter.command.down_m = target

    def _fly_airspeed(self, ctx: FlightContext) -> None:
        target = self._airspeed_target_m_s
        if target != target:
            return
        step = self._airspeed_acceleration_m_s2 * ctx.dt_s
        if step > 0.0:
            self._airspeed_m_s += min(step, max(-step, target - self._airspeed_m_s))
        self._loiter.command.airspeed_m_s = self._airspeed_m_s
