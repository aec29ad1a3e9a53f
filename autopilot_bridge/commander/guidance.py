"""Requests that send the vehicle somewhere: take off, go there, circle, return, fly the mission, pause."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import ACCEPTED, Reason, Verdict, failed
from autopilot_bridge.flight.goto import RepositionTask
from autopilot_bridge.flight.guided import GuidedKind, GuidedTask
from autopilot_bridge.flight.hold import HoldTask
from autopilot_bridge.flight.offboard import Vector
from autopilot_bridge.flight.orbit import OrbitTask, OrbitYaw
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.takeoff import TakeoffTask
from autopilot_bridge.flight.task import SpeedKind, SpeedTask

if TYPE_CHECKING:
    from autopilot_bridge.commander.commander import Commander

_MAX_DISTANCE_M: Final = 1e6
_MAX_SPEED_M_S: Final = 100.0
_MAX_RADIUS_M: Final = 1e4
_MIN_TAKEOFF_M: Final = 0.3


class Guidance:
    """Carries out requests for movement. Positions are local NED metres; NaN: as it is."""

    def __init__(self, commander: Commander) -> None:
        self._commander = commander
        self._parameters = commander.context.parameters
        self._speeds_m_s: dict[SpeedKind, float] = {}  # commanded ones, over the parameters'
        self._target = np.full(3, math.nan)

    def set_parameters(self, parameters: FlightParameters) -> None:
        """New flight parameters (a pilot changed one); a commanded speed lasts on."""
        if parameters != self._parameters:
            self._parameters = parameters
            self._apply_speeds()

    def forget_speed(self) -> None:
        """Back to the parameters' speeds; a commanded speed lasts until the next mode."""
        self._speeds_m_s.clear()
        self._apply_speeds()

    def _apply_speeds(self) -> None:
        """The flight parameters with the commanded speeds in place of theirs."""
        p, speeds = self._parameters, self._speeds_m_s
        changes: dict[str, Any] = {}
        if SpeedKind.GROUND_SPEED in speeds:
            cruise = min(speeds[SpeedKind.GROUND_SPEED], p.max_speed_m_s)
            changes = {"cruise_speed_m_s": cruise, "return_speed_m_s": cruise}
        if SpeedKind.CLIMB in speeds:
            changes["climb_speed_m_s"] = speeds[SpeedKind.CLIMB]
        if SpeedKind.DESCENT in speeds:
            changes["descend_speed_m_s"] = speeds[SpeedKind.DESCENT]
        self._commander.context.parameters = replace(p, **changes) if changes else p

    def takeoff(self, *, down_m: float, yaw_rad: float) -> Verdict:
        """Climb straight up to a height; NaN: the parameter's height over home.

        Where taking off is a mode of its own it can be commanded before arming. Elsewhere the vehicle must
        be armed, on the ground, in the mode that flies to places.
        """
        commander = self._commander
        height_m = self._height_over_home(down_m)
        yaw = yaw_rad if math.isfinite(yaw_rad) else None
        mode = commander.policy.takeoff_mode
        if mode is not None:
            commander.tasks.prepare(mode, lambda: TakeoffTask(height_m, yaw_rad=yaw))
            verdict = commander.set_mode(mode)
            if verdict.accepted and commander.mode is mode:
                commander.tasks.prepare(mode, lambda: TakeoffTask(height_m, yaw_rad=yaw))
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
        commander.tasks.start(TakeoffTask(height_m, yaw_rad=yaw))
        return ACCEPTED

    def land(self) -> Verdict:
        """Land here."""
        return self._commander.set_mode(FlightMode.LAND)

    def return_home(self) -> Verdict:
        """Fly home and land."""
        return self._commander.set_mode(FlightMode.RETURN)

    def reposition(
        self,
        *,
        north_m: float,
        east_m: float,
        down_m: float,
        yaw_rad: float = math.nan,
        speed_m_s: float = math.nan,
    ) -> Verdict:
        """Fly to a place and hold there; changes to the mode that does so."""
        commander = self._commander
        verdict = commander.set_mode(commander.policy.reposition_mode)
        if not verdict.accepted or not commander.armed or commander.mode is not commander.commanded_mode:
            return verdict
        place = np.array([_within(value, _MAX_DISTANCE_M) for value in (north_m, east_m, down_m)])
        yaw = _within(yaw_rad, 2.0 * math.pi)
        speed = speed_m_s if 0.0 < speed_m_s <= _MAX_SPEED_M_S else None
        if commander.policy.takeoff_mode is not None:
            commander.tasks.start(RepositionTask(place, yaw_rad=yaw, speed_m_s=speed))
        else:
            guided = self.guided()
            if guided is not None:
                self.go_to(guided, place, yaw_rad=yaw, speed_m_s=speed)
        return verdict

    def go_to(
        self,
        guided: GuidedTask,
        position_ned_m: Vector,
        *,
        yaw_rad: float = math.nan,
        speed_m_s: float | None = None,
    ) -> None:
        """Give the guided task a place to fly to."""
        self._target[:] = position_ned_m
        guided.set_position(self._commander.context, position_ned_m, yaw_rad=yaw_rad, speed_m_s=speed_m_s)

    def guided(self) -> GuidedTask | None:
        """The task that flies guided targets, made the active one; None where there is nothing to guide.

        On the ground only a takeoff is flown (ArduPilot).
        """
        commander = self._commander
        if not commander.airborne or commander.mode not in (FlightMode.GUIDED, FlightMode.GUIDED_NOGPS):
            return None
        guided = commander.setpoints.guided
        if commander.tasks.task is not guided:
            guided.set_hold(commander.context)
            commander.tasks.start(guided)
        return guided

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
        """Circle around a place; a negative radius circles counter-clockwise."""
        commander = self._commander
        centre = np.array([_within(value, _MAX_DISTANCE_M) for value in (north_m, east_m, down_m)])
        radius = radius_m if 0.0 < abs(radius_m) <= _MAX_RADIUS_M else None
        speed = abs(speed_m_s) if 0.0 < abs(speed_m_s) <= _MAX_SPEED_M_S else None
        if radius is not None and radius < 0.0:
            speed = -(commander.context.parameters.orbit_speed_m_s if speed is None else speed)
        behaviours = {behaviour.value for behaviour in OrbitYaw}
        yaw = OrbitYaw(yaw_behaviour) if yaw_behaviour in behaviours else OrbitYaw.FRONT_TO_CENTRE

        def make() -> OrbitTask:
            return OrbitTask(centre, radius, speed, yaw_behaviour=yaw)

        commander.tasks.prepare(FlightMode.ORBIT, make)
        verdict = commander.set_mode(FlightMode.ORBIT)
        if verdict.accepted and commander.mode is FlightMode.ORBIT:
            commander.tasks.prepare(FlightMode.ORBIT, make)
            commander.tasks.enter(FlightMode.ORBIT)
        return verdict

    def change_speed(self, speed_m_s: float, *, kind: int) -> None:
        """DO_CHANGE_SPEED, until the next mode; `kind` is a `SpeedKind`; <= 0: the parameters' again."""
        if not math.isfinite(speed_m_s):
            return
        if speed_m_s <= 0.0:
            self.forget_speed()
            for each in (SpeedKind.GROUND_SPEED, SpeedKind.CLIMB, SpeedKind.DESCENT):
                self._tell_speed(each, None)
            return
        changed = SpeedKind(kind) if kind in (SpeedKind.CLIMB, SpeedKind.DESCENT) else SpeedKind.GROUND_SPEED
        speed = min(speed_m_s, _MAX_SPEED_M_S)
        self._speeds_m_s[changed] = speed
        self._apply_speeds()
        self._tell_speed(changed, speed)

    def _tell_speed(self, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Have the task being flown, and one put aside for a pause, take the speed."""
        tasks = self._commander.tasks
        for task in (tasks.task, tasks.paused):
            if isinstance(task, SpeedTask):
                task.change_speed(self._commander.context, kind, speed_m_s)

    def turn(self, yaw_rad: float) -> None:
        """Point the nose somewhere, holding the place (CONDITION_YAW in GUIDED)."""
        commander = self._commander
        if not commander.airborne or commander.mode is not commander.policy.reposition_mode:
            return
        guided = commander.setpoints.guided
        active = commander.tasks.task is guided
        if active and guided.kind in (GuidedKind.VELOCITY, GuidedKind.ACCELERATION, GuidedKind.TRAJECTORY):
            guided.set_yaw(yaw_rad)
            return
        place = self._target.copy() if active and guided.kind is GuidedKind.POSITION else np.full(3, math.nan)
        commander.tasks.start(RepositionTask(place, yaw_rad=yaw_rad))

    def start_mission(self) -> Verdict:
        """Fly the stored mission from its current item."""
        commander = self._commander
        verdict = commander.set_mode(FlightMode.MISSION)
        if verdict.accepted and commander.armed and not commander.tasks.mission_started:
            commander.tasks.mission_started = True
            if commander.landed:
                commander.tasks.enter(FlightMode.MISSION)
        return verdict

    def pause(self) -> Verdict:
        """Hold here for now, without a mode change."""
        tasks = self._commander.tasks
        if self._commander.mode not in (FlightMode.MISSION, FlightMode.GUIDED):
            return failed(Reason.WRONG_MODE)
        if tasks.paused is None and tasks.task is not None and self._commander.airborne:
            paused = tasks.task
            tasks.start(HoldTask())
            tasks.paused = paused
        return ACCEPTED

    def resume(self) -> Verdict:
        """Go on with what was paused."""
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
    """`value`, or NaN for what is not finite or beyond any sense."""
    return value if abs(value) <= limit else math.nan
