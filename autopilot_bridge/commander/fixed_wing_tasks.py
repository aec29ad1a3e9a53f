"""The flight tasks of a fixed-wing aircraft.

Phases of an aircraft's take-off and landing, as events for the pilot.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from autopilot_bridge.commander.events import (
    Event,
    FlareStarted,
    LandingAborted,
    LandingApproachStarted,
    LaunchDetected,
    TakeoffStarted,
)
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.vehicle_tasks import Circle, CircleFlown, TargetPosition, VehicleTasks
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.fixed_wing import (
    DescendTask,
    GuidedTask,
    LandPhase,
    LandTask,
    LoiterTask,
    ManualMode,
    ManualTask,
    MissionTask,
    OffboardTask,
    ReturnTask,
    TakeoffPhase,
    TakeoffTask,
)
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.plan_reading import is_waypoint, target_of
from autopilot_bridge.flight.task import FlightTask, IdleTask, SpeedKind
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav

_NOTHING: Final[tuple[Event, ...]] = ()


class PhaseWatch:
    """Compares the phase of the task being flown with the phase 20 ms before."""

    def __init__(self) -> None:
        self._task: FlightTask | None = None
        self._phase: TakeoffPhase | LandPhase | None = None

    def update(self, task: FlightTask | None, context: FlightContext) -> Sequence[Event]:
        """The events of a new phase."""
        if task is None or not context.armed or not isinstance(task, (TakeoffTask, LandTask)):
            self._task = None
            return _NOTHING
        phase, before = task.phase, self._phase if task is self._task else None
        self._task, self._phase = task, phase
        if phase is before:
            return _NOTHING
        if isinstance(task, TakeoffTask):
            return self._takeoff(task, context, before)
        return self._landing(task, context)

    def _takeoff(self, task: TakeoffTask, context: FlightContext, before: object) -> Sequence[Event]:
        begins = task.phase in (TakeoffPhase.LAUNCHED, TakeoffPhase.ROLL)
        thrown = task.phase is TakeoffPhase.CLIMB_OUT and before is TakeoffPhase.LAUNCHED
        if not (begins or thrown):
            return _NOTHING
        events: list[Event] = []
        if begins:
            force = float(context.nav[nav.SPECIFIC_FORCE_FRD_M_S2][0])
            launched = task.phase is TakeoffPhase.LAUNCHED
            delay_s = context.fixed_wing.launch_delay_s if launched else 0.0
            events.append(LaunchDetected(time_us=context.time_us, acceleration_m_s2=force, delay_s=delay_s))
        if thrown or task.phase is TakeoffPhase.ROLL:
            home_down_m = float(context.home_ned_m[2])
            down_m = float(task.place_ned_m[2])
            started = TakeoffStarted(
                time_us=context.time_us,
                ground_speed_m_s=_ground_speed(context),
                height_m=(0.0 if math.isnan(home_down_m) else home_down_m) - down_m,
                heading_deg=math.degrees(float(context.nav[nav.EULER_RAD][2])) % 360.0,
            )
            events.append(started)
        return events

    def _landing(self, task: LandTask, context: FlightContext) -> Sequence[Event]:
        time_us, height_m = context.time_us, context.height_above_home_m
        match task.phase:
            case LandPhase.APPROACH:
                return (LandingApproachStarted(time_us=time_us, height_m=height_m),)
            case LandPhase.FLARE:
                above_m = float(context.nav[nav.HEIGHT_ABOVE_GROUND_M])
                flare = FlareStarted(
                    time_us=time_us,
                    height_m=height_m if math.isnan(above_m) else above_m,
                    sink_m_s=float(context.nav[nav.VEL_NED_M_S][2]),
                    ground_speed_m_s=_ground_speed(context),
                )
                return (flare,)
            case LandPhase.GO_AROUND:
                climb_m = task.abort_climb_m(context.fixed_wing)
                return (LandingAborted(time_us=time_us, height_m=climb_m),)
        return _NOTHING


def _ground_speed(context: FlightContext) -> float:
    north, east, _ = context.nav[nav.VEL_NED_M_S].tolist()
    return math.hypot(north, east)


_MANUAL: Final = {
    FlightMode.MANUAL: ManualMode.MANUAL,
    FlightMode.STABILIZED: ManualMode.STABILIZED,
    FlightMode.ACRO: ManualMode.ACRO,
    FlightMode.ALTITUDE: ManualMode.ALTITUDE,
    FlightMode.POSITION: ManualMode.POSITION,
    FlightMode.POSITION_SLOW: ManualMode.POSITION,
    FlightMode.TRAINING: ManualMode.TRAINING,
    FlightMode.FBWA: ManualMode.FBWA,
    FlightMode.AUTOTUNE: ManualMode.FBWA,
    FlightMode.FBWB: ManualMode.FBWB,
    FlightMode.CRUISE: ManualMode.CRUISE,
}
_LIFTING_THROTTLE: Final = 0.1


class FixedWingTasks(VehicleTasks):
    """`VehicleTasks` of a fixed-wing aircraft."""

    def __init__(self, context: FlightContext, missions: MissionStore, policy: CommanderPolicy) -> None:
        super().__init__(context, missions, policy)
        self._phases = PhaseWatch()
        self.offboard: OffboardTask = OffboardTask()
        self.guided: GuidedTask = GuidedTask()

    def of_mode(self, mode: FlightMode, *, mission_started: bool) -> FlightTask:
        """The initial task of a mode."""
        manual = _MANUAL.get(mode)
        if manual is not None:
            return ManualTask(manual)
        match mode:
            case FlightMode.TAKEOFF:
                return TakeoffTask()
            case FlightMode.MISSION:
                return MissionTask(
                    self._missions, first_item=self._policy.mission_first_item, rules=self._policy.plans
                )
            case FlightMode.OFFBOARD:
                return self.offboard
            case FlightMode.GUIDED:
                self.guided.set_hold(self._context)
                return self.guided
            case FlightMode.RETURN:
                return ReturnTask(
                    self._missions,
                    first_item=self._policy.mission_first_item,
                    rules=self._policy.plans,
                    plan_task=MissionTask,
                )
            case FlightMode.LAND:
                return LandTask()
            case FlightMode.DESCEND:
                return DescendTask()
            case FlightMode.TERMINATION:
                return IdleTask()
        return LoiterTask()

    def hold(self) -> FlightTask:
        """Circle at the present position."""
        return LoiterTask()

    def takeoff(self, height_m: float | None, yaw_rad: float | None, place: TargetPosition) -> FlightTask:
        """Take off straight ahead; the heading is that of the runway or launcher."""
        known = bool(np.isfinite(place.ned_m[0:2]).all())
        return TakeoffTask(height_m, place_ned_m=place.ned_m if known else None)

    def hold_after_takeoff(self, task: FlightTask | None) -> FlightTask:
        """Circle at the target position and height of the take-off."""
        return LoiterTask(task.place_ned_m) if isinstance(task, TakeoffTask) else LoiterTask()

    def reposition(self, place: TargetPosition) -> FlightTask:
        """Fly to a position and circle there."""
        return LoiterTask(place.ned_m, place.radius_m, place.speed_m_s)

    def guide_to(self, context: FlightContext, place: TargetPosition) -> None:
        """Set the position at which the guided task circles."""
        self.guided.set_position(context, place.ned_m, radius_m=place.radius_m, airspeed_m_s=place.speed_m_s)

    def orbit(self, circle: Circle) -> FlightTask:
        """Circle around a position."""
        radius_m = circle.radius_m
        if not circle.clockwise:
            radius_m = -(abs(self._context.fixed_wing.loiter_radius_m) if radius_m is None else radius_m)
        return LoiterTask(circle.centre_ned_m, radius_m, circle.speed_m_s)

    def ends_on_ground(self, task: FlightTask | None) -> bool:
        """Landings, returns and missions end on the ground."""
        return isinstance(task, LandTask | DescendTask | ReturnTask | MissionTask)

    def wants_up(self, context: FlightContext) -> bool:
        """A take-off is in progress, or power is commanded."""
        setpoint = context.setpoint
        if context.phase is FlightPhase.TAKEOFF:
            return True
        if not setpoint[sp.LEVEL] > sp.IDLE or context.phase is FlightPhase.LANDING:
            return False
        throttle = float(setpoint[sp.THROTTLE])
        return math.isnan(throttle) or throttle > _LIFTING_THROTTLE

    def watch(self, task: FlightTask | None, context: FlightContext) -> Sequence[Event]:
        """Phases of take-off and landing, also when they are part of a plan or a return."""
        return self._phases.update(_flown_by(task), context)

    def distance_to(self, item: MissionItem, context: FlightContext) -> float:
        """Horizontal distance from the position of a waypoint or a circle."""
        target = target_of(item, context) if is_waypoint(item) else None
        if target is None:
            return math.nan
        north_m, east_m, _ = context.nav[nav.POS_NED_M].tolist()
        return math.hypot(north_m - float(target[0]), east_m - float(target[1]))

    def circle_of(self, task: FlightTask | None) -> CircleFlown | None:
        """The circle being flown, once it is captured, in any task."""
        loiter = _loiter_of(task)
        if loiter is None or not loiter.circling:
            return None
        north_m, east_m, down_m = (float(value) for value in loiter.centre_ned_m)
        return CircleFlown(loiter.radius_m, north_m, east_m, down_m)

    def speed_kind(self, kind: int) -> SpeedKind:
        """PX4's aircraft use any speed as an airspeed; ArduPlane has a ground speed too."""
        if kind == SpeedKind.GROUND_SPEED and self._policy.ground_speed_apart:
            return SpeedKind.GROUND_SPEED
        return SpeedKind.AIRSPEED

    def with_speeds(
        self, parameters: FixedWingFlightParameters, speeds_m_s: Mapping[SpeedKind, float]
    ) -> Any:
        """The cruising airspeed, within the limits; a minimum ground speed is not flown."""
        wanted = speeds_m_s.get(SpeedKind.AIRSPEED)
        if wanted is None:
            return parameters
        low, high = parameters.airspeed_min_m_s, parameters.airspeed_max_m_s
        return replace(parameters, airspeed_trim_m_s=min(high, max(low, wanted)))


def _flown_by(task: FlightTask | None) -> FlightTask | None:
    """The task that a plan or a return runs, else the task itself."""
    while type(task) is MissionTask or type(task) is ReturnTask:  # 50 Hz: `isinstance` of an ABC is slower
        task = task.sub_task
    return task


def _loiter_of(task: FlightTask | None) -> LoiterTask | None:
    """The circling part of a task."""
    task = _flown_by(task)
    if isinstance(task, GuidedTask):
        return task.circle
    return task if isinstance(task, LoiterTask) else None
