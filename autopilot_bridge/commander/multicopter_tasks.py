"""The flight tasks of a multicopter."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.vehicle_tasks import Circle, CircleFlown, TargetPosition, VehicleTasks
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.follow import FollowTask
from autopilot_bridge.flight.multicopter.guided import GuidedTask
from autopilot_bridge.flight.multicopter.hold import BrakeTask, HoldTask, RepositionTask
from autopilot_bridge.flight.multicopter.land import LandTask
from autopilot_bridge.flight.multicopter.manual import LoiterTask, ManualMode, ManualTask
from autopilot_bridge.flight.multicopter.mission import MissionTask
from autopilot_bridge.flight.multicopter.offboard import OffboardTask
from autopilot_bridge.flight.multicopter.orbit import OrbitTask, OrbitYaw, circle_ahead
from autopilot_bridge.flight.multicopter.precision_land import PrecisionLandTask, landing_task
from autopilot_bridge.flight.multicopter.return_home import ReturnTask
from autopilot_bridge.flight.multicopter.takeoff import TakeoffTask
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.task import FlightTask, GuidedKind, IdleTask, SpeedKind
from autopilot_bridge.mission_plan import MissionStore

_MANUAL: Final = {
    FlightMode.MANUAL: ManualMode.STABILIZED,
    FlightMode.STABILIZED: ManualMode.STABILIZED,
    FlightMode.ACRO: ManualMode.ACRO,
    FlightMode.ALTITUDE: ManualMode.ALTITUDE,
    FlightMode.POSITION: ManualMode.POSITION,
    FlightMode.POSITION_SLOW: ManualMode.POSITION,
    FlightMode.POSHOLD: ManualMode.POSITION,
}
_YAW_BEHAVIOURS: Final = frozenset(behaviour.value for behaviour in OrbitYaw)


class MulticopterTasks(VehicleTasks):
    """`VehicleTasks` of a multicopter."""

    def __init__(self, context: FlightContext, missions: MissionStore, policy: CommanderPolicy) -> None:
        super().__init__(context, missions, policy)
        self._target = np.full(3, math.nan)
        self.offboard: OffboardTask = OffboardTask()
        self.guided: GuidedTask = GuidedTask()

    def of_mode(self, mode: FlightMode, *, mission_started: bool) -> FlightTask:
        """The initial task of a mode."""
        context, policy = self._context, self._policy
        parameters: Any = context.parameters
        manual = _MANUAL.get(mode)
        if manual is not None:
            return ManualTask(manual)
        match mode:
            case FlightMode.TAKEOFF:
                return TakeoffTask()
            case FlightMode.MISSION:
                if policy.mission_waits_for_start and context.on_ground and not mission_started:
                    return IdleTask()
                return MissionTask(self._missions, first_item=policy.mission_first_item, rules=policy.plans)
            case FlightMode.OFFBOARD:
                return self.offboard
            case FlightMode.GUIDED | FlightMode.GUIDED_NOGPS:
                self.guided.set_hold(context)
                return self.guided
            case FlightMode.RETURN | FlightMode.SMART_RETURN | FlightMode.AUTO_RETURN:
                return ReturnTask(
                    self._missions,
                    first_item=policy.mission_first_item,
                    rules=policy.plans,
                    plan_task=MissionTask,
                )
            case FlightMode.LAND:
                return landing_task(context)
            case FlightMode.PRECISION_LAND:
                return PrecisionLandTask()
            case FlightMode.DESCEND:
                return LandTask()
            case FlightMode.FOLLOW:
                return FollowTask()
            case FlightMode.ORBIT:
                return OrbitTask(np.full(3, math.nan))
            case FlightMode.CIRCLE:
                return OrbitTask(circle_ahead(context, parameters.orbit_radius_m))
            case FlightMode.BRAKE:
                return BrakeTask()
            case FlightMode.TERMINATION:
                return IdleTask()
            case FlightMode.HOLD if policy.manual_control_always:
                return LoiterTask()  # the sticks move the vehicle (ArduPilot)
        return HoldTask()

    def hold(self) -> FlightTask:
        """Brake and hold the position."""
        return HoldTask()

    def takeoff(self, height_m: float | None, yaw_rad: float | None, place: TargetPosition) -> FlightTask:
        """Climb straight up."""
        return TakeoffTask(height_m, yaw_rad=yaw_rad)

    def hold_after_takeoff(self, task: FlightTask | None) -> FlightTask:
        """Hold the target position of the climb."""
        return HoldTask(task.place_ned_m) if isinstance(task, TakeoffTask) else HoldTask()

    def reposition(self, place: TargetPosition) -> FlightTask:
        """Fly to a position and hold it."""
        return RepositionTask(place.ned_m, yaw_rad=place.yaw_rad, speed_m_s=place.speed_m_s)

    def guide_to(self, context: FlightContext, place: TargetPosition) -> None:
        """Set the target position of the guided task."""
        self._target[:] = place.ned_m
        self.guided.set_position(
            context,
            place.ned_m,
            yaw_rad=place.yaw_rad,
            yaw_rate_rad_s=place.yaw_rate_rad_s,
            speed_m_s=place.speed_m_s,
        )

    def orbit(self, circle: Circle) -> FlightTask:
        """Circle around a position."""
        speed = circle.speed_m_s
        if not circle.clockwise:
            parameters: Any = self._context.parameters
            speed = -(parameters.orbit_speed_m_s if speed is None else speed)
        known = circle.yaw_behaviour in _YAW_BEHAVIOURS
        yaw = OrbitYaw(circle.yaw_behaviour) if known else OrbitYaw.FRONT_TO_CENTRE
        return OrbitTask(circle.centre_ned_m, circle.radius_m, speed, yaw_behaviour=yaw)

    def turn(self, context: FlightContext, active: FlightTask | None, turn: Turn) -> FlightTask | None:
        """Point the nose in a direction while holding the position or continuing a streamed motion."""
        guided = self.guided
        kind = guided.kind if active is guided else GuidedKind.HOLD
        if kind in (GuidedKind.VELOCITY, GuidedKind.ACCELERATION, GuidedKind.TRAJECTORY):
            guided.set_turn(turn)
            return None
        place = self._target.copy() if kind is GuidedKind.POSITION else np.full(3, math.nan)
        return RepositionTask(place, turn=turn)

    def ends_on_ground(self, task: FlightTask | None) -> bool:
        """Landings, returns and missions end on the ground."""
        return isinstance(task, LandTask | PrecisionLandTask | ReturnTask | MissionTask)

    def wants_up(self, context: FlightContext) -> bool:
        """True when the task would turn the motors faster than idle."""
        return bool(context.setpoint[sp.LEVEL] > sp.IDLE) or context.phase is FlightPhase.TAKEOFF

    def circle_of(self, task: FlightTask | None) -> CircleFlown | None:
        """The circle of an `OrbitTask`, once the vehicle is on it."""
        if not isinstance(task, OrbitTask) or not task.circling:
            return None
        north_m, east_m, down_m = (float(value) for value in task.centre_ned_m)
        return CircleFlown(math.copysign(task.radius_m, task.velocity_m_s), north_m, east_m, down_m)

    def speed_kind(self, kind: int) -> SpeedKind:
        """Climb and descent speeds; all other kinds are the ground speed."""
        return SpeedKind(kind) if kind in (SpeedKind.CLIMB, SpeedKind.DESCENT) else SpeedKind.GROUND_SPEED

    def with_speeds(self, parameters: FlightParameters, speeds_m_s: Mapping[SpeedKind, float]) -> Any:
        """Cruise, return, climb and descend speeds; air and ground speed are the same."""
        changes: dict[str, Any] = {}
        if SpeedKind.GROUND_SPEED in speeds_m_s:
            cruise = min(speeds_m_s[SpeedKind.GROUND_SPEED], parameters.max_speed_m_s)
            changes = {"cruise_speed_m_s": cruise, "return_speed_m_s": cruise}
        if SpeedKind.CLIMB in speeds_m_s:
            changes["climb_speed_m_s"] = speeds_m_s[SpeedKind.CLIMB]
        if SpeedKind.DESCENT in speeds_m_s:
            changes["descend_speed_m_s"] = speeds_m_s[SpeedKind.DESCENT]
        return replace(parameters, **changes) if changes else parameters
