"""Requests for movement: take off, fly to a position, circle, return, fly the mission, pause."""

import math
from typing import Any, Final

import numpy as np

from autopilot_bridge.commander.commanded_vehicle import CommandedVehicle
from autopilot_bridge.commander.events import CommandDenied
from autopilot_bridge.commander.modes import GUIDED_MODES, FlightMode
from autopilot_bridge.commander.vehicle_tasks import Circle, GoAroundTask, TargetPosition
from autopilot_bridge.commander.verdict import ACCEPTED, Reason, Verdict, failed
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.task import AnyVector, FlightTask, SpeedKind, SpeedTask

_DO_REPOSITION: Final = 192
_MAX_DISTANCE_M: Final = 1e6
_MAX_SPEED_M_S: Final = 100.0
_MAX_RADIUS_M: Final = 1e4
_MIN_TAKEOFF_M: Final = 0.3


class Guidance:
    """Executes requests for movement. Positions are local NED metres; NaN: unchanged."""

    def __init__(self, commander: CommandedVehicle) -> None:
        self._commander = commander
        self._vehicle = commander.vehicle
        self._parameters: Any = commander.context.parameters
        self._speeds_m_s: dict[SpeedKind, float] = {}  # commanded speeds, which replace the parameters'

    def set_parameters(self, parameters: Any) -> None:
        """Use new flight parameters (a parameter has changed); commanded speeds stay."""
        if parameters != self._parameters:
            self._parameters = parameters
            self._apply_speeds()

    def forget_speed(self) -> None:
        """Return to the parameters' speeds; a commanded speed lasts until the next mode."""
        self._speeds_m_s.clear()
        self._apply_speeds()

    def _apply_speeds(self) -> None:
        """Set the flight parameters with the commanded speeds instead of their own."""
        changed = self._vehicle.with_speeds(self._parameters, self._speeds_m_s)
        self._commander.context.parameters = changed

    def takeoff(
        self, *, down_m: float, yaw_rad: float, north_m: float = math.nan, east_m: float = math.nan
    ) -> Verdict:
        """Climb to a height; NaN: the parameter's height over home.

        If take-off is a separate mode, it can be commanded before arming. Otherwise the vehicle must be
        armed, on the ground, in the mode that flies to positions. An aircraft circles around the position
        after the climb.
        """
        commander = self._commander
        height_m = self._height_over_home(down_m)
        yaw = yaw_rad if math.isfinite(yaw_rad) else None
        place = _place(north_m, east_m, down_m)

        def make() -> FlightTask:
            return self._vehicle.takeoff(height_m, yaw, place)

        if not commander.policy.takeoff_by_command:
            return failed(Reason.WRONG_MODE)
        mode = commander.policy.takeoff_mode
        if mode is not None:
            commander.tasks.prepare(mode, make)
            verdict = commander.set_mode(mode)
            if verdict.accepted and commander.mode is mode:
                commander.tasks.prepare(mode, make)
                commander.tasks.enter(mode)
            return verdict
        if not commander.armed:
            return failed(Reason.NOT_ARMED)
        if commander.mode is not commander.policy.reposition_mode:
            return failed(Reason.WRONG_MODE)
        if not commander.landed:
            return failed(Reason.ALREADY_FLYING)
        if height_m is None or height_m < _MIN_TAKEOFF_M:
            return failed(Reason.BAD_ALTITUDE)
        commander.tasks.start(make())
        return ACCEPTED

    def land(self) -> Verdict:
        """Land at the present position."""
        return self._commander.set_mode(FlightMode.LAND)

    def return_home(self) -> Verdict:
        """Fly home and land."""
        return self._commander.set_mode(FlightMode.RETURN)

    def go_around(self, height_m: float = math.nan) -> Verdict:
        """Abort a landing, climb to a height over home (NaN: the parameter's) and fly the approach again."""
        task = self._commander.tasks.task
        if isinstance(task, GoAroundTask) and task.go_around(self._commander.context, height_m):
            return ACCEPTED
        return failed(Reason.WRONG_MODE)

    def reposition(
        self,
        *,
        north_m: float,
        east_m: float,
        down_m: float,
        yaw_rad: float = math.nan,
        speed_m_s: float = math.nan,
        radius_m: float = math.nan,
    ) -> Verdict:
        """Fly to a position and hold there, in the mode for it.

        Args:
            north_m, east_m, down_m: the position.
            yaw_rad: heading there (multicopter).
            speed_m_s: speed on the way; not positive: the parameter's.
            radius_m: radius of an aircraft's circle there, positive clockwise; 0 or NaN: the parameter's.
        """
        commander = self._commander
        fence, frame = commander.parameters.fence, commander.context.frame
        bounded = commander.policy.fence_bounds_targets and fence.bounds_targets
        if bounded and not commander.fence.allows((north_m, east_m, down_m), frame, fence):
            denied = CommandDenied(
                time_us=commander.time_us, command=_DO_REPOSITION, reason=Reason.OUTSIDE_FENCE
            )
            commander.emit(denied)
            return Verdict(result=commander.policy.mode_denied, reasons=(Reason.OUTSIDE_FENCE,))
        verdict = commander.set_mode(commander.policy.reposition_mode)
        if not verdict.accepted or not commander.armed or commander.mode is not commander.commanded_mode:
            return verdict
        target = _place(
            north_m,
            east_m,
            down_m,
            yaw_rad=_within(yaw_rad, 2.0 * math.pi),
            speed_m_s=speed_m_s if 0.0 < speed_m_s <= _MAX_SPEED_M_S else None,
            radius_m=radius_m if 0.0 < abs(radius_m) <= _MAX_RADIUS_M else None,
        )
        if commander.policy.reposition_mode not in GUIDED_MODES:
            commander.tasks.start(self._vehicle.reposition(target))
        elif self.guided() is not None:
            self._vehicle.guide_to(commander.context, target)
        return verdict

    def go_to(
        self,
        guided: Any,
        position_ned_m: AnyVector,
        *,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
        speed_m_s: float | None = None,
    ) -> None:
        """Give the guided task (the one `guided` returned) a target position."""
        place = TargetPosition(
            ned_m=np.array(position_ned_m),
            yaw_rad=yaw_rad,
            yaw_rate_rad_s=yaw_rate_rad_s,
            speed_m_s=speed_m_s,
        )
        self._vehicle.guide_to(self._commander.context, place)

    def go_to_place(self, place: TargetPosition | None) -> None:
        """Make the guided task fly to a position, in GUIDED; None: no change."""
        if place is not None and self.guided() is not None:
            self._vehicle.guide_to(self._commander.context, place)

    def guided(self) -> Any:
        """Activate and return the task that flies guided targets; None if there is none to guide.

        On the ground only a take-off is flown (ArduPilot).
        """
        commander = self._commander
        if not commander.airborne or commander.mode not in (FlightMode.GUIDED, FlightMode.GUIDED_NOGPS):
            return None
        guided = self._vehicle.guided
        if commander.tasks.task is not guided:
            guided.set_hold(commander.context)
            commander.tasks.start(guided)
        return guided

    def change_heading(self, heading_rad: float, *, course: bool, acceleration_m_s2: float) -> Verdict:
        """Fly a heading, or a course over ground, until another command (GUIDED).

        Args:
            heading_rad: clockwise from north.
            course: course over ground; else heading through the air.
            acceleration_m_s2: lateral acceleration of the turn; not positive, or NaN: that of the bank limit.
        """
        guided = self._guided_aircraft()
        if guided is None:
            return failed(Reason.WRONG_MODE)
        acceleration = acceleration_m_s2 if acceleration_m_s2 > 0.0 else math.inf
        guided.set_heading(self._commander.context, heading_rad, course, acceleration)
        return ACCEPTED

    def change_altitude(self, down_m: float, *, rate_m_s: float) -> Verdict:
        """Fly to a height (GUIDED); a rate of NaN: as fast as the limits allow."""
        guided = self._guided_aircraft()
        if guided is None:
            return failed(Reason.WRONG_MODE)
        guided.set_altitude(self._commander.context, down_m, rate_m_s)
        return ACCEPTED

    def change_airspeed(self, airspeed_m_s: float, *, acceleration_m_s2: float) -> Verdict:
        """Fly an equivalent airspeed (GUIDED); an acceleration of NaN: as the limits allow."""
        guided = self._guided_aircraft()
        if guided is None:
            return failed(Reason.WRONG_MODE)
        guided.set_airspeed(self._commander.context, airspeed_m_s, acceleration_m_s2)
        return ACCEPTED

    def _guided_aircraft(self) -> Any:
        """The guided task of an aircraft, whose heading, height and airspeed can be changed separately."""
        guided = self.guided() if self._commander.mode is FlightMode.GUIDED else None
        return guided if hasattr(guided, "set_heading") else None

    def orbit(
        self,
        *,
        radius_m: float,
        speed_m_s: float,
        yaw_behaviour: int,
        north_m: float,
        east_m: float,
        down_m: float,
    ) -> Verdict:
        """Circle around a position; a negative radius circles counter-clockwise."""
        commander = self._commander
        circle = Circle(
            centre_ned_m=_place(north_m, east_m, down_m).ned_m,
            radius_m=abs(radius_m) if 0.0 < abs(radius_m) <= _MAX_RADIUS_M else None,
            speed_m_s=abs(speed_m_s) if 0.0 < abs(speed_m_s) <= _MAX_SPEED_M_S else None,
            clockwise=not -_MAX_RADIUS_M <= radius_m < 0.0,
            yaw_behaviour=yaw_behaviour,
        )

        def make() -> FlightTask:
            return self._vehicle.orbit(circle)

        mode = commander.policy.orbit_mode
        if commander.armed:
            commander.tasks.prepare(mode, make)
        verdict = commander.set_mode(mode)
        if verdict.accepted and commander.armed and commander.mode is mode:
            commander.tasks.prepare(mode, make)
            commander.tasks.enter(mode)
        return verdict

    def change_speed(self, speed_m_s: float, *, kind: int) -> None:
        """DO_CHANGE_SPEED, until the next mode; `kind` is a `SpeedKind`; <= 0: the parameters' speed."""
        if not math.isfinite(speed_m_s):
            return
        if speed_m_s <= 0.0:
            self.forget_speed()
            for each in dict.fromkeys(self._vehicle.speed_kind(kind) for kind in SpeedKind):
                self._report_speed(each, None)
            return
        changed = self._vehicle.speed_kind(kind)
        speed = min(speed_m_s, _MAX_SPEED_M_S)
        self._speeds_m_s[changed] = speed
        self._apply_speeds()
        self._report_speed(changed, speed)

    def _report_speed(self, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Set the speed of the task being flown, and of one that is paused."""
        tasks = self._commander.tasks
        for task in (tasks.task, tasks.paused):
            if isinstance(task, SpeedTask):
                task.change_speed(self._commander.context, kind, speed_m_s)

    def turn(self, turn: Turn) -> None:
        """Point the nose in a direction while holding the position (CONDITION_YAW in GUIDED)."""
        commander = self._commander
        if not commander.airborne or commander.mode is not commander.policy.reposition_mode:
            return
        commander.context.look_at(None)
        task = self._vehicle.turn(commander.context, commander.tasks.task, turn)
        if task is not None:
            commander.tasks.start(task)

    def start_mission(self) -> Verdict:
        """Fly the stored mission from its current item."""
        commander = self._commander
        verdict = commander.set_mode(FlightMode.MISSION)
        if verdict.accepted and commander.armed and not commander.tasks.mission_started:
            commander.tasks.mission_started = True
            if commander.landed and commander.policy.mission_waits_for_start:
                commander.tasks.enter(FlightMode.MISSION)
        return verdict

    def pause(self) -> Verdict:
        """Hold the present position without a mode change."""
        tasks = self._commander.tasks
        if self._commander.mode not in (FlightMode.MISSION, FlightMode.GUIDED):
            return failed(Reason.WRONG_MODE)
        if tasks.paused is None and tasks.task is not None and self._commander.airborne:
            paused = tasks.task
            tasks.start(self._vehicle.hold())
            tasks.paused = paused
        return ACCEPTED

    def resume(self) -> Verdict:
        """Continue the paused task."""
        tasks = self._commander.tasks
        if self._commander.mode not in (FlightMode.MISSION, FlightMode.GUIDED):
            return failed(Reason.WRONG_MODE)
        if tasks.paused is not None:
            paused, tasks.paused = tasks.paused, None
            tasks.start(paused)
        return ACCEPTED

    def _height_over_home(self, down_m: float) -> float | None:
        if not math.isfinite(down_m):
            return None
        home_down_m = float(self._commander.context.home_ned_m[2])
        height_m = (home_down_m if math.isfinite(home_down_m) else 0.0) - down_m
        return max(_MIN_TAKEOFF_M, height_m) if abs(height_m) < _MAX_DISTANCE_M else None


def _within(value: float, limit: float) -> float:
    """`value`, or NaN if it is not finite or beyond the limit."""
    return value if abs(value) <= limit else math.nan


def _place(north_m: float, east_m: float, down_m: float, **how: Any) -> TargetPosition:
    """A position; coordinates that are too large become NaN."""
    ned_m = np.array([_within(value, _MAX_DISTANCE_M) for value in (north_m, east_m, down_m)])
    return TargetPosition(ned_m=ned_m, **how)
