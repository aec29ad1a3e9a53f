"""Phases of an aircraft's take-off and landing, as events for the pilot."""

import math
from collections.abc import Sequence
from typing import Final

from autopilot_bridge.commander.events import (
    Event,
    FlareStarted,
    LandingAborted,
    LandingApproachStarted,
    LaunchDetected,
    TakeoffStarted,
)
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing import LandPhase, LandTask, TakeoffPhase, TakeoffTask
from autopilot_bridge.flight.task import FlightTask
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
