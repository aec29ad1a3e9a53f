"""Circling around a place: hold, reposition, DO_ORBIT, NAV_LOITER_*, ArduPlane's LOITER and CIRCLE."""

import math

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, TaskFinished
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, GuidedPath
from autopilot_bridge.flight.fixed_wing.circle import Circle
from autopilot_bridge.flight.fixed_wing.descend import PositionLost
from autopilot_bridge.flight.fixed_wing.state import FlightCommand
from autopilot_bridge.flight.task import SpeedKind, TaskStatus


class LoiterTask(AircraftTask):
    """Fly to a circle along its tangent and circle there, climbing or descending on the way.

    Without a position the bank is held instead, and the height; "here" is then where it is found again.

    Args:
        centre_ned_m: centre and height, (3,); NaN components: of the place where the task starts; None: here.
        radius_m: positive clockwise seen from above; None or NaN: the parameter's.
        airspeed_m_s: equivalent airspeed; None or NaN: the parameter's.
        turns: DONE (and circling on) after so many; None: never.
        glides: from GLIDE_SLOPE_MIN above the circle on, the height follows the straight way to its centre
            until the circle is reached (ArduPlane); else the circle's height is flown at once.

    Attributes:
        centre_ned_m: centre and height flown, (3,); its NaNs are filled in by `activate`.
        radius_m: with its sign; NaN before `activate` where none was given.
    """

    def __init__(
        self,
        centre_ned_m: Array | None = None,
        radius_m: float | None = None,
        airspeed_m_s: float | None = None,
        turns: float | None = None,
        *,
        glides: bool = False,
    ) -> None:
        super().__init__()
        self._wanted: Array = np.full(3, np.nan)
        if centre_ned_m is not None:
            self._wanted[:] = centre_ned_m
        self.centre_ned_m: Array = self._wanted.copy()
        self.radius_m = math.nan if radius_m is None or radius_m == 0.0 else radius_m
        self._airspeed_m_s = math.nan if airspeed_m_s is None else airspeed_m_s
        self._turns = turns
        self._path = GuidedPath()
        self._lost = PositionLost()
        self._circle = Circle(0.0, 0.0, 1.0)
        self._finished = False
        self._glides = glides
        self._placeless = False
        self._start: Array = np.full(3, np.nan)

    @property
    def circling(self) -> bool:
        """The circle is captured."""
        return self._circle.circling

    @property
    def turns_done(self) -> float:
        """Turns flown since then."""
        return self._circle.turns

    def set_height(self, down_m: float) -> None:
        """Climb or descend to another height while circling, local NED."""
        self._wanted[2] = self.centre_ned_m[2] = down_m
        self._glides = False

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Another airspeed (DO_CHANGE_SPEED); None: the parameter's."""
        if kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED):
            self._airspeed_m_s = math.nan if speed_m_s is None else speed_m_s

    def _begin(self, ctx: FlightContext) -> None:
        state = self._state
        self._placeless = not ctx.position_valid and not bool(np.isfinite(self._wanted[0:2]).all())
        here = (state.north_m, state.east_m, state.down_m)
        self.centre_ned_m[:] = np.where(np.isfinite(self._wanted), self._wanted, here)
        self._start[:] = here
        if not (math.isfinite(self.radius_m) and abs(self.radius_m) >= 1.0):
            self.radius_m = ctx.fixed_wing.loiter_radius_m
        self._circle = Circle(float(self.centre_ned_m[0]), float(self.centre_ned_m[1]), self.radius_m)
        self._circle.begin(state)
        self._lost.reset()
        self._finished = False

    @property
    def command(self) -> FlightCommand:
        """What `guide` has found."""
        return self._command

    def guide(self, ctx: FlightContext) -> FlightCommand:
        """One update without writing the setpoint, for a task that changes part of it."""
        self._state.read(ctx)
        self._command.clear()
        self._follow(ctx)
        return self._command

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        self._follow(ctx)
        self._command.write(ctx)
        done = self._turns is not None and self._circle.turns >= self._turns
        if done and not self._finished:
            self._finished = True
            ctx.events.append(TaskFinished("loiter"))
        return TaskStatus.DONE if done else TaskStatus.RUNNING

    def _follow(self, ctx: FlightContext) -> None:
        command, guidance = self._command, self._path.of(ctx)
        command.airspeed_m_s = self._airspeed_m_s
        command.down_m = self._down_m(ctx)
        if ctx.position_valid:
            if self._lost.found():
                if self._placeless:
                    self._begin(ctx)
                self._circle.begin(self._state)
            self._circle.follow(self._state, guidance, ctx.fixed_wing.roll_time_constant_s)
            command.course_rad = guidance.course_rad
            command.lateral_acceleration_m_s2 = guidance.lateral_acceleration_m_s2
        else:
            self._lost.fly(ctx, command, self._circle.direction)

    def _down_m(self, ctx: FlightContext) -> float:
        """Height to fly at now, local down: the circle's, or the glide's on the way there."""
        end_m = float(self.centre_ned_m[2])
        self._glides = self._glides and not self._circle.circling
        drop_m = end_m - float(self._start[2])
        if not self._glides or drop_m < ctx.fixed_wing.glide_slope_min_m:
            return end_m
        way = self.centre_ned_m[0:2] - self._start[0:2]
        flown = (self._state.north_m - self._start[0], self._state.east_m - self._start[1])
        length_2 = float(way @ way)
        share = 1.0 if length_2 < 1.0 else min(1.0, max(0.0, float(way @ np.array(flown)) / length_2))
        return end_m - (1.0 - share) * drop_m
