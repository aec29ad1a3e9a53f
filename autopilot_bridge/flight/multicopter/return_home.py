"""Return to home and land: PX4's Return and ArduPilot's RTL, which differ in parameters only.

The parameters are set by `flight_parameters` of `firmware/px4/copter/mapping.py` and of ArduPilot's.
"""

import math

import numpy as np

from autopilot_bridge.flight.context import (
    Array,
    FlightContext,
    FlightPhase,
    ReturnLandingStarted,
    ReturnStarted,
)
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.precision_land import landing_task
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp
from autopilot_bridge.flight.parameters import ALONG_PLAN, FlightParameters
from autopilot_bridge.flight.return_place import (
    HomewardTask,
    ReturnPhase,
    ReturnPlace,
    choose_return,
    plan_landing,
)
from autopilot_bridge.flight.task import FlightTask, SpeedKind, SpeedTask, TaskStatus
from autopilot_bridge.navigation import layout as nav_layout


def return_height(distance_m: float, height_m: float, parameters: FlightParameters) -> float:
    """Height over home of the flight home.

    It is never lower than the present height; otherwise it is the return altitude, near home only as high as
    the cone around home requires (PX4 RTL_CONE_ANG in RTL_MIN_DIST; ArduCopter RTL_CONE_SLOPE everywhere).
    """
    p = parameters
    wanted = min(p.return_altitude_m, p.return_height_max_m)
    if p.return_cone_half_angle_rad > 0.0 and distance_m <= p.return_min_distance_m:
        floor = min(wanted, p.return_descend_altitude_m)
        wanted = min(wanted, max(distance_m / math.tan(p.return_cone_half_angle_rad), floor))
    return max(height_m, min(max(height_m + p.return_climb_min_m, wanted), p.return_height_max_m))


class ReturnTask(HomewardTask):
    """Climb, fly home, descend, wait, land. Without a home or a position it lands where it is.

    The target is the place from `choose_return`: a rally point or the landing of the plan may replace home.
    With a negative loiter time the vehicle stays over home (PX4 RTL_LAND_DELAY = -1); with a final height it
    hovers at that height in the end (ArduPilot RTL_ALT_FINAL).
    """

    _target: Array
    _motion: SmoothMotion | None = None
    _ramp: TakeoffRamp | None = None
    _land: FlightTask | None = None
    _plan: FlightTask | None = None

    def activate(self, ctx: FlightContext) -> None:
        p = ctx.multicopter
        ctx.phase = FlightPhase.CRUISE
        self.phase = ReturnPhase.CLIMB
        self._wait_s = 0.0
        self._land = self._plan = self.place = None
        self._ramp = TakeoffRamp(ctx)
        self._motion = SmoothMotion(ctx, speed_m_s=p.return_speed_m_s)
        if ctx.position_valid:
            self.place = choose_return(
                ctx, p.rally, p.return_destination, plan_landing(self._store), self._store
            )
        place = self.place
        if place is None:
            self._start_landing(ctx)
            return
        if p.return_destination in ALONG_PLAN and self._fly_plan(ctx):
            return
        position = self._motion.trajectory.position_ned_m
        velocity = self._motion.trajectory.velocity_ned_m_s
        home = place.ned_m
        distance = math.hypot(float(home[0] - position[0]), float(home[1] - position[1]))
        height_m = float(home[2] - position[2])
        height = return_height(distance, height_m, p)
        if math.isfinite(place.altitude_down_m):  # a rally point's own altitude, if it is higher
            own_m = min(float(home[2]) - place.altitude_down_m, p.return_height_max_m)
            height = max(height, own_m)
        # the climb ends where braking ends
        brake_s = float(np.hypot(velocity[0], velocity[1])) / (2.0 * p.acceleration_m_s2)
        self._target = position + velocity * brake_s
        self._target[2] = float(home[2]) - height
        ctx.events.append(ReturnStarted(float(self._target[2]), float(home[2])))

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Set another speed on the way home (DO_CHANGE_SPEED); the landing has its own speeds."""
        if isinstance(self._plan, SpeedTask):
            self._plan.change_speed(ctx, kind, speed_m_s)
        if self._motion is None:
            return
        horizontal = kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED)
        if speed_m_s is None and horizontal:
            speed_m_s = ctx.multicopter.return_speed_m_s
        self._motion.change_speed(ctx, kind, speed_m_s)

    def _fly_plan(self, ctx: FlightContext) -> bool:
        """Continue along the plan, or with its landing; False if there is none."""
        self._plan = self._plan_home(ctx, ctx.multicopter.return_destination, self.place)
        if self._plan is None:
            return False
        self.phase = ReturnPhase.PLAN
        self._plan.activate(ctx)
        return True

    def _start_landing(self, ctx: FlightContext) -> None:
        self.phase = ReturnPhase.LAND
        place = self.place if ctx.position_valid else None
        yaw = math.nan if place is not None and place.rally else ctx.home_yaw_rad
        self._land = landing_task(
            ctx,
            None if place is None else place.ned_m.copy(),
            yaw if place is not None and math.isfinite(yaw) else None,
            precision=ctx.multicopter.return_precision,
        )
        self._land.activate(ctx)

    def _close(self, ctx: FlightContext, motion: SmoothMotion, horizontal_m: float) -> bool:
        p = ctx.multicopter
        position = ctx.nav[nav_layout.POS_NED_M]
        away = math.hypot(float(position[0] - self._target[0]), float(position[1] - self._target[1]))
        height_error = abs(float(position[2] - self._target[2]))
        reached = away < horizontal_m and height_error < p.acceptance_altitude_m
        return reached and (motion.stopped or not p.return_stops)

    def _advance(self, ctx: FlightContext, motion: SmoothMotion, place: ReturnPlace) -> None:
        """Begin the next phase when this one is finished."""
        p = ctx.multicopter
        ground_down = float(place.ned_m[2])
        low_down = max(float(self._target[2]), ground_down - p.return_descend_altitude_m)
        if self.phase is ReturnPhase.CLIMB and self._close(ctx, motion, math.inf):
            if place.landing is not None and self._fly_plan(ctx):
                return
            self.phase = ReturnPhase.FLY
            self._target[0:2] = place.ned_m[0:2]
        elif self.phase is ReturnPhase.FLY and self._close(ctx, motion, p.acceptance_radius_m):
            self.phase = ReturnPhase.LOITER if p.return_loiters_high else ReturnPhase.DESCEND
            if self.phase is ReturnPhase.DESCEND:
                self._target[2] = low_down
        elif self.phase is ReturnPhase.DESCEND and self._close(ctx, motion, p.acceptance_radius_m):
            self.phase = ReturnPhase.LOITER
        else:
            return
        motion.begin_leg()

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        if self._land is not None:
            return self._land.update(ctx)
        if not ramp.update(ctx, False, 0.0):
            motion.restart(ctx)
            return TaskStatus.DONE
        if self._plan is not None:
            return self._plan.update(ctx)
        place = self.place
        if place is None or not ctx.position_valid:
            self._start_landing(ctx)
            return TaskStatus.RUNNING
        motion.synchronise(ctx)
        self._advance(ctx, motion, place)
        if self._plan is not None:
            return self._plan.update(ctx)
        if self.phase is ReturnPhase.LOITER:
            wait = ctx.multicopter.return_loiter_time_s
            self._wait_s += ctx.dt_s
            if 0.0 <= wait <= self._wait_s:
                if ctx.multicopter.return_stays_at_m <= 0.0:
                    ctx.events.append(ReturnLandingStarted())
                    self._start_landing(ctx)
                    assert self._land is not None
                    return self._land.update(ctx)
                self.phase = ReturnPhase.STAY
                self._target[2] = float(place.ned_m[2]) - ctx.multicopter.return_stays_at_m
                motion.begin_leg()
        motion.fly_to(ctx, self._target)
        over_home = self.phase in (ReturnPhase.DESCEND, ReturnPhase.LOITER, ReturnPhase.STAY)
        climbing = self.phase is ReturnPhase.CLIMB
        at_home = math.nan if place.rally else ctx.home_yaw_rad
        yaw = at_home if over_home else (motion.heading.yaw_rad if climbing else math.nan)
        motion.steer(ctx, yaw, self._target)
        motion.write(ctx)
        return TaskStatus.RUNNING
