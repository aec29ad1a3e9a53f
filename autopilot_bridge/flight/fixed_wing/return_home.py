"""Return: PX4's fixed-wing Return and ArduPlane's RTL, which differ in parameters only.

The parameters are set by `flight_parameters` of `firmware/px4/plane/mapping.py` and of ArduPilot's.
"""

import math
from dataclasses import replace

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, ReturnStarted
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, LandingTask
from autopilot_bridge.flight.fixed_wing.landing import LandTask
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.parameters import ALONG_PLAN, ReturnDestination
from autopilot_bridge.flight.plan_reading import landing_start
from autopilot_bridge.flight.return_place import (
    HomewardTask,
    ReturnPhase,
    ReturnPlace,
    choose_return,
    plan_landing,
)
from autopilot_bridge.flight.task import FlightTask, SpeedKind, SpeedTask, TaskStatus


def return_height(height_m: float, parameters: FixedWingFlightParameters) -> float:
    """Height over home to fly home at: the return altitude; PX4: never lower than now."""
    p = parameters
    if not p.return_climbs:
        return p.return_altitude_m
    return max(height_m + p.return_climb_min_m, p.return_altitude_m)


class ReturnTask(HomewardTask, AircraftTask):
    """Climb, fly home, circle down, circle there or land; or fly the landing sequence of the plan.

    Home is the place that `choose_return` gives: a rally point may take its place. Without a home it circles
    where it is; without a position it does as `LoiterTask`.
    """

    _home: Array
    _sub: FlightTask | None = None

    @property
    def sub_task(self) -> FlightTask | None:
        """What is being flown: a circle, the landing, or the plan."""
        return self._sub

    def _set_sub(self, ctx: FlightContext, task: FlightTask) -> None:
        self._sub = task
        task.activate(ctx)

    def _landing_start(self, destination: ReturnDestination) -> int | None:
        """Where the plan's landing begins; ArduPlane requires a DO_LAND_START."""
        if self._store is None:
            return None
        marked = destination in (
            ReturnDestination.LANDING_SEQUENCE,
            ReturnDestination.HOME_THEN_LANDING_SEQUENCE,
        )
        return landing_start(self._store.items) if marked else plan_landing(self._store)

    def _begin(self, ctx: FlightContext) -> None:
        p, state = ctx.fixed_wing, self._state
        self._wait_s = 0.0
        destination = p.return_destination
        landing = self._landing_start(destination)
        self.place = place = choose_return(ctx, p.rally, destination, landing, self._store)
        if place is None:
            self.phase = ReturnPhase.LOITER
            self._set_sub(ctx, LoiterTask())
            return
        if (place.landing is not None or destination in ALONG_PLAN) and self._land_by_plan(ctx, place):
            return
        self._home = np.array(place.ned_m)
        ground_down = float(self._home[2])
        height = ground_down - state.down_m
        wanted = return_height(height, p)
        own_down = place.altitude_down_m
        self._home[2] = own_down if math.isfinite(own_down) else ground_down - wanted
        ctx.events.append(ReturnStarted(float(self._home[2]), ground_down))
        if p.return_climbs and wanted - height > p.acceptance_altitude_m:
            self.phase = ReturnPhase.CLIMB
            self._set_sub(ctx, LoiterTask(np.array([math.nan, math.nan, self._home[2]])))
        else:
            self._fly_home(ctx)

    def _fly_home(self, ctx: FlightContext) -> None:
        self.phase = ReturnPhase.FLY
        self._set_sub(ctx, LoiterTask(self._home, ctx.fixed_wing.return_loiter_radius_m, glides=True))

    def _land_by_plan(self, ctx: FlightContext, place: ReturnPlace) -> bool:
        """Go on along the plan, or with its landing sequence, if there is one."""
        plan = self._plan_home(ctx, ctx.fixed_wing.return_destination, place)
        if plan is None:
            return False
        self.phase = ReturnPhase.LAND
        self._set_sub(ctx, plan)
        return True

    def _land_after_home(self, ctx: FlightContext) -> bool:
        """Over home the landing sequence begins, where that is configured and there is one."""
        destination, place = ctx.fixed_wing.return_destination, self.place
        start = self._landing_start(destination)
        if destination is not ReturnDestination.HOME_THEN_LANDING_SEQUENCE or place is None or start is None:
            return False
        return self._land_by_plan(ctx, replace(place, landing=start))

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Another airspeed on the way (DO_CHANGE_SPEED)."""
        if isinstance(self._sub, SpeedTask):
            self._sub.change_speed(ctx, kind, speed_m_s)

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Break a landing off."""
        return isinstance(self._sub, LandingTask) and self._sub.go_around(ctx, height_m)

    def update(self, ctx: FlightContext) -> TaskStatus:
        """Write `ctx.setpoint`; DONE on the ground."""
        if self._active and self.phase is ReturnPhase.LAND and self._sub is not None and not self._rested:
            return self._sub.update(ctx)
        return super().update(ctx)

    def _rest(self, ctx: FlightContext) -> TaskStatus:
        super()._rest(ctx)
        return TaskStatus.DONE

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        sub = self._sub
        assert sub is not None
        sub.update(ctx)
        if isinstance(sub, LoiterTask):
            self._advance(ctx, sub)
        return TaskStatus.RUNNING

    def _advance(self, ctx: FlightContext, loiter: LoiterTask) -> None:
        """Go on to the next phase when this one is done."""
        p = ctx.fixed_wing
        at_height = abs(self._state.down_m - float(loiter.centre_ned_m[2])) < min(
            p.acceptance_altitude_m, 10.0
        )
        place = self.place
        ground_down = math.nan if place is None else float(place.ned_m[2])
        if self.phase is ReturnPhase.CLIMB and at_height:
            self._fly_home(ctx)
        elif self.phase is ReturnPhase.FLY and loiter.circling:
            if self._land_after_home(ctx):
                return
            self.phase = ReturnPhase.DESCEND
            if p.return_climbs and math.isfinite(ground_down):
                low_down = max(float(self._home[2]), ground_down - p.return_descend_altitude_m)
                loiter.set_height(low_down)
        elif self.phase is ReturnPhase.DESCEND and at_height:
            self.phase = ReturnPhase.LOITER
        elif self.phase is ReturnPhase.LOITER:
            self._wait_s += ctx.dt_s
            if 0.0 <= p.return_loiter_time_s <= self._wait_s and place is not None:
                self.phase = ReturnPhase.LAND
                self._set_sub(ctx, LandTask(np.array(place.ned_m)))
