"""Take-off: by a run along the runway, or thrown by a catapult or a hand."""

import math
from enum import IntEnum
from typing import ClassVar

import numpy as np

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TaskFinished
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, GuidedPath
from autopilot_bridge.flight.fixed_wing.climb_out_checks import LaunchDetector
from autopilot_bridge.flight.fixed_wing.line import Line
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters, LaunchKind
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint


class TakeoffPhase(IntEnum):
    """Where the take-off stands."""

    WAIT = 0  # for the launch
    LAUNCHED = 1  # motor still off
    ROLL = 2  # throttle up, along the runway
    CLIMB_OUT = 3  # straight ahead
    CLIMB = 4  # to the place, or circling
    REACHED = 5


class TakeoffTask(AircraftTask):
    """Take off, climb straight out, then climb on to a height, towards a place or circling. DONE at height.

    A runway take-off holds the line the aircraft stands on; a launched one waits with the propeller stopped
    until the launch is felt, and climbs with level wings. In the air already it only climbs.

    Args:
        altitude_above_home_m: height to reach; None: the parameter's. Over the start while home is unset.
        place_ned_m: where to circle then, (3,) (down is ignored); None, NaN: where the climb-out ends.

    Attributes:
        phase: see `TakeoffPhase`.
    """

    works_on_ground: ClassVar[bool] = True

    def __init__(self, altitude_above_home_m: float | None = None, place_ned_m: Array | None = None) -> None:
        super().__init__()
        if altitude_above_home_m is not None and not math.isfinite(altitude_above_home_m):
            raise ValueError(f"take-off altitude {altitude_above_home_m} m is not a finite number")
        self._altitude_m = altitude_above_home_m
        self._place: Array = np.full(3, np.nan)
        if place_ned_m is not None:
            self._place[:] = place_ned_m
        self._path = GuidedPath()
        self._runway = Line()
        self._launch = LaunchDetector()
        self._loiter: LoiterTask | None = None
        self._down_m = self._start_down_m = 0.0
        self._throttle = 0.0
        self._rotated_s = 0.0
        self._fast = False
        self._way_m = math.nan
        self.phase = TakeoffPhase.WAIT

    @property
    def place_ned_m(self) -> Array:
        """Where the climb ends, (3,); a copy; NaN where that isn't known before."""
        if self._loiter is not None:
            return self._loiter.centre_ned_m.copy()
        place = self._place.copy()
        place[2] = self._down_m
        return place

    def _begin(self, ctx: FlightContext) -> None:
        p, state = ctx.fixed_wing, self._state
        ctx.phase = FlightPhase.TAKEOFF
        self._loiter = None
        self._start_down_m = state.down_m
        altitude = p.takeoff_altitude_m if self._altitude_m is None else self._altitude_m
        home_down = float(ctx.home_ned_m[2])
        self._down_m = (state.down_m if math.isnan(home_down) else home_down) - altitude
        self._throttle = 0.0
        self._rotated_s = 0.0
        self._fast = False
        self._launch.reset()
        self._runway.begin(state, state.yaw_rad)
        if not ctx.on_ground:
            self._down_m = min(self._down_m, state.down_m)
            self._climb_on(ctx)
        elif p.launch is LaunchKind.RUNWAY:
            self.phase = TakeoffPhase.ROLL
        else:
            self.phase = TakeoffPhase.WAIT

    def _rest(self, ctx: FlightContext) -> TaskStatus:
        if not self._rested:
            super()._rest(ctx)
        return TaskStatus.RUNNING

    def update(self, ctx: FlightContext) -> TaskStatus:
        if self._rested and ctx.armed:  # armed again: from the start
            self.activate(ctx)
        return super().update(ctx)

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        p, command = ctx.fixed_wing, self._command
        if self.phase >= TakeoffPhase.CLIMB:
            return self._fly_climb(ctx)
        command.flaps = p.flaps_takeoff
        command.airspeed_m_s = p.takeoff_airspeed_m_s
        if self.phase is TakeoffPhase.WAIT and not self._wait(ctx, p):
            clear_setpoint(ctx.setpoint, sp.IDLE)
            return TaskStatus.RUNNING
        if self.phase is TakeoffPhase.LAUNCHED:
            self._launched(ctx, p)
        elif self.phase is TakeoffPhase.ROLL:
            self._roll(ctx, p)
        else:
            self._climb_out(ctx, p)
        command.write(ctx)
        return TaskStatus.RUNNING

    def _wait(self, ctx: FlightContext, p: FixedWingFlightParameters) -> bool:
        """Has the launch been felt?"""
        state = self._state
        self._start_down_m = state.down_m
        if self._launch.update(ctx, state, p):
            self.phase = TakeoffPhase.LAUNCHED
            course = state.course_rad if state.ground_speed_m_s > 3.0 else state.yaw_rad
            self._runway.begin(state, course)
            return True
        return False

    def _launched(self, ctx: FlightContext, p: FixedWingFlightParameters) -> None:
        command, launch = self._command, self._launch
        command.roll_rad = 0.0
        command.pitch_rad = p.takeoff_pitch_min_rad
        command.throttle = 0.0
        if launch.since_launch_s >= p.launch_delay_s:
            self._throttle = p.takeoff_throttle_max
            self._rotated_s = p.rotation_time_s
            self.phase = TakeoffPhase.CLIMB_OUT
        launch.since_launch_s += ctx.dt_s

    def _roll(self, ctx: FlightContext, p: FixedWingFlightParameters) -> None:
        """Along the runway until the airspeed carries."""
        state, command = self._state, self._command
        ramp = p.takeoff_throttle_ramp_s
        step = ctx.dt_s / ramp * p.takeoff_throttle_max if ramp > 0.0 else 1.0
        self._throttle = min(p.takeoff_throttle_max, self._throttle + step)
        command.throttle = self._throttle
        command.roll_rad = 0.0
        command.pitch_rad = p.takeoff_roll_pitch_rad
        command.steering_heading_rad = self._runway.steering_heading(
            state, ctx.position_valid and self._runway.known
        )
        airspeed = state.airspeed_m_s if state.airspeed_m_s == state.airspeed_m_s else state.true_airspeed_m_s
        off_ground = self._start_down_m - state.down_m > p.climb_out.left_ground_m
        if airspeed >= p.rotation_airspeed_m_s or off_ground:
            self.phase = TakeoffPhase.CLIMB_OUT

    def _climb_out(self, ctx: FlightContext, p: FixedWingFlightParameters) -> None:
        """Straight ahead at full power: the pitch holds the airspeed, between limits.

        Where the aircraft gets too fast at that, or its airspeed isn't known, a climb rate is flown instead.
        """
        state, command = self._state, self._command
        if ctx.position_valid and not self._runway.known:  # found on the way
            self._runway.begin(state, state.course_rad)
        self._rotated_s += ctx.dt_s
        self._throttle = p.takeoff_throttle_max
        climbed = self._start_down_m - state.down_m
        # rotation: the limits of the pitch open gradually
        part = min(1.0, self._rotated_s / p.rotation_time_s)
        command.pitch_min_rad = (
            p.takeoff_roll_pitch_rad + (p.takeoff_pitch_min_rad - p.takeoff_roll_pitch_rad) * part
        )
        # near the ground the tail has no room, and speed matters more than height
        free = min(1.0, max(0.0, climbed / p.takeoff_clearance_m))
        command.pitch_max_rad = command.pitch_min_rad + free * max(
            0.0, p.pitch_max_rad - command.pitch_min_rad
        )
        command.throttle_max = p.takeoff_throttle_max
        remaining = state.down_m - self._down_m
        self._climb_to_height(p, remaining)
        low = climbed < p.climb_out.low_m
        if ctx.position_valid:
            self._runway.follow(state, self._path.of(ctx), command)
        else:
            command.heading_rad = self._runway.heading_rad
        share = min(
            1.0, max(0.0, (climbed - p.climb_out.low_m) / max(p.takeoff_clearance_m - p.climb_out.low_m, 1.0))
        )
        command.roll_limit_rad = (
            p.ground_bank_max_rad + (p.takeoff_bank_max_rad - p.ground_bank_max_rad) * share
        )
        if low and p.launch is LaunchKind.RUNWAY:
            command.steering_heading_rad = self._runway.heading_rad
        has_place = math.isfinite(float(self._place[0] + self._place[1]))
        if remaining <= p.climb_out.reached_m or (climbed >= p.takeoff_clearance_m and has_place):
            self._climb_on(ctx)

    def _climb_on(self, ctx: FlightContext) -> None:
        """Clear of the ground: straight to the place if there is one, or circle here."""
        self.phase = TakeoffPhase.CLIMB
        state = self._state
        north, east = float(self._place[0]), float(self._place[1])
        self._way_m = math.hypot(north - state.north_m, east - state.east_m)
        if ctx.position_valid and self._way_m > abs(ctx.fixed_wing.loiter_radius_m):  # false for NaN
            self._runway.begin(state, math.atan2(east - state.east_m, north - state.north_m))
        else:
            self._circle(ctx)

    def _circle(self, ctx: FlightContext) -> None:
        centre = self._place.copy()
        centre[2] = self._down_m
        self._loiter = LoiterTask(centre)
        self._loiter.activate(ctx)
        if self.phase is not TakeoffPhase.REACHED:
            ctx.phase = FlightPhase.TAKEOFF

    def _fly_climb(self, ctx: FlightContext) -> TaskStatus:
        """To the place and around it, climbing."""
        state, command, loiter = self._state, self._command, self._loiter
        remaining = state.down_m - self._down_m
        if loiter is not None:
            loiter.update(ctx)
        else:
            self._climb_to_height(ctx.fixed_wing, remaining)
            self._runway.follow(state, self._path.of(ctx), command)
            command.write(ctx)
            near = self._runway.along_m(state) > self._way_m - abs(ctx.fixed_wing.loiter_radius_m)
            if near or not ctx.position_valid:
                self._circle(ctx)
        if self.phase is TakeoffPhase.CLIMB and remaining <= ctx.fixed_wing.climb_out.reached_m:
            self.phase = TakeoffPhase.REACHED
            ctx.phase = FlightPhase.CRUISE
            ctx.events.append(TaskFinished("takeoff"))
        return TaskStatus.DONE if self.phase is TakeoffPhase.REACHED else TaskStatus.RUNNING

    def _climb_to_height(self, p: FixedWingFlightParameters, remaining_m: float) -> None:
        """Full power, the pitch holds the airspeed; near the height the energy control takes over.

        What is still slow gathers speed on its way up: low over the ground the aircraft does not dive for it.
        """
        state, command = self._state, self._command
        command.airspeed_m_s = p.takeoff_airspeed_m_s
        climb = max(p.climb_rate_m_s, p.climb_out.climb_share * p.climb_max_m_s)
        self._fast = self._fast or state.airspeed_m_s > p.climb_out.fast_share * p.takeoff_airspeed_m_s
        if remaining_m <= p.climb_out.capture_s * climb:
            command.down_m = self._down_m
        elif self._fast or state.airspeed_m_s != state.airspeed_m_s:
            command.height_rate_m_s = climb
        else:
            command.throttle = p.takeoff_throttle_max
            if self.phase is TakeoffPhase.CLIMB and state.airspeed_m_s > p.airspeed_min_m_s:
                command.pitch_min_rad = p.takeoff_pitch_min_rad
