"""Landing: circle down to the approach, glide slope, flare, roll out; and the go-around."""

import math
from enum import IntEnum
from typing import ClassVar

import numpy as np

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TouchedDown
from autopilot_bridge.flight.fixed_wing.approach import Approach, approach_along_leg, approach_into_wind
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, GuidedPath
from autopilot_bridge.flight.fixed_wing.circle import Circle
from autopilot_bridge.flight.fixed_wing.climb_out_checks import PowerCheck
from autopilot_bridge.flight.fixed_wing.descend import DescendTask
from autopilot_bridge.flight.fixed_wing.flare import Flare
from autopilot_bridge.flight.fixed_wing.line import Line
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.surface_wind import SurfaceWind
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint
from flightsim.foundation.vectors import wrap_pi


class LandPhase(IntEnum):
    """Where the landing stands."""

    CIRCLE = 0  # down (or up) to the height of the approach
    APPROACH = 1
    FLARE = 2
    ROLL_OUT = 3
    LANDED = 4
    GO_AROUND = 5
    BLIND = 6  # the position is lost: down where it is


class LandTask(AircraftTask):
    """Land at a place. DONE on the ground, with the propeller stopped and a `TouchedDown` event.

    With an approach leg it is flown at once, its slope the glide slope. Without one the aircraft circles down
    beside the place and lands against the wind. Once the ground is detected, nothing turns again.

    Args:
        place_ned_m: where to touch down, (3,); NaN components: of the place where the task starts, on the
            ground of home; None: here.
        approach_ned_m: where the approach leg begins, (3,); None: no leg is given.

    Attributes:
        phase: see `LandPhase`.
        approach: the approach flown; None before `activate`.
    """

    works_on_ground: ClassVar[bool] = True

    def __init__(self, place_ned_m: Array | None = None, approach_ned_m: Array | None = None) -> None:
        super().__init__()
        self._wanted: Array = np.full(3, np.nan)
        if place_ned_m is not None:
            self._wanted[:] = place_ned_m
        self._start = None if approach_ned_m is None else np.array(approach_ned_m, dtype=np.float64)
        self._path = GuidedPath()
        self._line = Line()
        self._circle: Circle | None = None
        self._flare = Flare()
        self._wind = SurfaceWind()
        self._blind: DescendTask | None = None
        self._power = PowerCheck()
        self._rolled_s = 0.0
        self._go_arounds = 0
        self._abort_climb_m = math.nan
        self._touch_pitch_rad = 0.0
        self.approach: Approach | None = None
        self.phase = LandPhase.CIRCLE

    def _begin(self, ctx: FlightContext) -> None:
        state = self._state
        ctx.phase = FlightPhase.LANDING
        self._blind = None
        self._rolled_s = 0.0
        self._flare.reset()
        place = self._place(ctx)
        start = self._start
        leg = None
        if start is not None:
            at = (float(start[0]), float(start[1]), float(start[2]))
            leg = approach_along_leg(at, place, ctx.fixed_wing)
        self.approach = approach_into_wind(ctx, state, place) if leg is None else leg
        self._line.set(self.approach.north_m, self.approach.east_m, self.approach.course_rad)
        if leg is not None and self._on_leg(ctx, leg):
            self._enter_approach(ctx, leg)
        else:
            self._enter_circle(ctx)

    def _on_leg(self, ctx: FlightContext, leg: Approach) -> bool:
        """The aircraft is where the leg begins, so that it needs no circle to get there."""
        state, p, radius = self._state, ctx.fixed_wing.landing, abs(ctx.fixed_wing.loiter_radius_m)
        past_entry = self._line.along_m(state) + leg.length_m
        return (
            -p.before_entry_radii * radius < past_entry < p.along_leg_share * leg.length_m
            and abs(self._line.offset_m(state)) < radius
            and leg.entry_down_m - state.down_m < p.too_high_m
        )

    def _place(self, ctx: FlightContext) -> tuple[float, float, float]:
        state = self._state
        north, east, down = self._wanted.tolist()
        if down != down:
            down = float(ctx.home_ned_m[2])
            if down != down:
                known = state.height_above_ground_m == state.height_above_ground_m
                down = state.down_m + state.height_above_ground_m if known else 0.0
        return state.north_m if north != north else north, state.east_m if east != east else east, down

    def _enter_circle(self, ctx: FlightContext) -> None:
        approach = self.approach
        assert approach is not None
        radius = ctx.fixed_wing.loiter_radius_m
        north, east = approach.entry_circle(radius)
        self._circle = Circle(north, east, radius)
        self._circle.begin(self._state)
        self.phase = LandPhase.CIRCLE

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Break the landing off: climb straight, come back to the approach (MAV_CMD_DO_GO_AROUND).

        The height to climb to is over home; NaN: the parameter's. False where there is nothing to break off
        any more (or yet).
        """
        if self.phase not in (LandPhase.APPROACH, LandPhase.FLARE):
            return False
        self._abort_climb_m = height_m
        self._begin_go_around()
        return True

    def _begin_go_around(self) -> None:
        self.phase = LandPhase.GO_AROUND
        self._power.begin()

    def _land(self, ctx: FlightContext) -> TaskStatus:
        clear_setpoint(ctx.setpoint, sp.IDLE if ctx.armed else sp.OFF)
        if self.phase is not LandPhase.LANDED:
            self.phase = LandPhase.LANDED
            ctx.phase = FlightPhase.CRUISE
            ctx.events.append(TouchedDown())
        return TaskStatus.DONE

    def _rest(self, ctx: FlightContext) -> TaskStatus:
        return self._land(ctx)

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        approach, p, state = self.approach, ctx.fixed_wing, self._state
        if ctx.on_ground or self.phase is LandPhase.LANDED or approach is None:
            return self._land(ctx)
        low = self.phase in (LandPhase.FLARE, LandPhase.ROLL_OUT) or (
            self.phase is LandPhase.APPROACH and self._height(p, approach.down_m) < p.landing.blind_m
        )
        if not ctx.position_valid and not low:
            return self._fly_blind(ctx)
        if self._blind is not None:
            self._blind = None
            if self._line.known:
                self._enter_circle(ctx)
            else:  # there was no position from the start
                self._begin(ctx)
        command = self._command
        command.flaps = p.flaps_landing
        command.airspeed_m_s = p.landing_airspeed_m_s
        match self.phase:
            case LandPhase.CIRCLE:
                self._fly_circle(ctx, p, approach)
            case LandPhase.APPROACH:
                self._fly_approach(ctx, p, approach)
            case LandPhase.FLARE:
                self._fly_flare(ctx, p)
            case LandPhase.GO_AROUND:
                self._fly_go_around(ctx, p, approach)
            case _ if self._bounced(p):
                self.phase = LandPhase.FLARE
                self._fly_flare(ctx, p)
            case _:
                self._fly_roll_out(ctx, p)
        command.write(ctx)
        if self.phase is LandPhase.ROLL_OUT and state.ground_speed_m_s < p.landing.standing_m_s:
            # the controls of a standing aircraft would follow every gust
            clear_setpoint(ctx.setpoint, sp.SURFACES_DIRECT)
            ctx.setpoint[sp.BRAKE] = p.brake
        return TaskStatus.RUNNING

    def _fly_blind(self, ctx: FlightContext) -> TaskStatus:
        """Without a position there is no approach: down where it is."""
        if self._blind is None:
            self._blind = DescendTask()
            self._blind.activate(ctx)
            self.phase = LandPhase.BLIND
        self._blind.update(ctx)
        return TaskStatus.RUNNING

    def _fly_circle(self, ctx: FlightContext, p: FixedWingFlightParameters, approach: Approach) -> None:
        state, command, circle = self._state, self._command, self._circle
        assert circle is not None
        guidance = self._path.of(ctx)
        circle.follow(state, guidance, p.roll_time_constant_s)
        command.course_rad = guidance.course_rad
        command.lateral_acceleration_m_s2 = guidance.lateral_acceleration_m_s2
        command.down_m = approach.entry_down_m
        at_height = abs(state.down_m - approach.entry_down_m) < p.landing.entry_height_m
        command.airspeed_m_s = p.landing_airspeed_m_s if at_height else math.nan
        past_entry = self._line.along_m(state) + approach.length_m
        if (
            circle.circling
            and at_height
            and abs(past_entry) < p.landing.entry_share * circle.radius_m
            and abs(wrap_pi(state.course_rad - approach.course_rad)) < p.landing.entry_course_rad
        ):
            self._enter_approach(ctx, approach)

    def _enter_approach(self, ctx: FlightContext, approach: Approach) -> None:
        self.phase = LandPhase.APPROACH
        self._wind.reset(approach.down_m - approach.entry_down_m, ctx.fixed_wing.surface_wind)

    def _height(self, p: FixedWingFlightParameters, down_m: float) -> float:
        """Over the ground, as far as it is known."""
        measured = self._state.height_above_ground_m
        if p.rangefinder_landing and measured == measured:
            return measured - p.standing_height_m
        return down_m - self._state.down_m

    def _limit_bank(self, p: FixedWingFlightParameters, height_m: float) -> None:
        share = (height_m - p.landing.low_m) / (p.landing.free_bank_m - p.landing.low_m)
        if share < 1.0:
            share = max(0.0, share)
            self._command.roll_limit_rad = (
                p.ground_bank_max_rad + (p.bank_max_rad - p.ground_bank_max_rad) * share
            )

    def _follow_wind(self, ctx: FlightContext, height_m: float) -> None:
        """Follow the wind over the height."""
        made_up = ctx.health is not None and ctx.health.airspeed_synthetic
        standing_m = ctx.fixed_wing.standing_height_m
        self._wind.update(self._state, height_m, standing_m, ctx.dt_s, measured=not made_up)

    def _fly_approach(self, ctx: FlightContext, p: FixedWingFlightParameters, approach: Approach) -> None:
        state, command = self._state, self._command
        height = self._height(p, approach.down_m)
        self._follow_wind(ctx, height)
        self._limit_bank(p, height)
        share = (height - p.landing.low_m) / (p.landing.dive_free_m - p.landing.low_m)
        if share < 1.0:
            command.pitch_min_rad = p.landing.dive_low_rad + (p.pitch_min_rad - p.landing.dive_low_rad) * max(
                0.0, share
            )
        sink = state.ground_speed_m_s * approach.slope
        past_place = -math.inf
        flare_height = max(p.flare_height_m, p.flare_time_s * sink)
        if ctx.position_valid:
            self._line.follow(state, self._path.of(ctx), command)
            past_place = self._line.along_m(state)
            shift = approach.flare_shift_m(state.ground_speed_m_s, flare_height, p.flare_sink_m_s)
            slope_down = approach.down_m + (past_place + shift) * approach.slope
            command.down_m = max(approach.entry_down_m, slope_down)
            if slope_down > approach.entry_down_m:
                # the slope is held more tightly than heights elsewhere (PX4: FW_LND_THRTC_SC)
                command.down_m += p.landing.slope_gain * (slope_down - state.down_m)
                command.height_rate_m_s = -sink
            if (
                height < p.landing.short_final_m
                and p.trim_throttle > 0.0
                and state.airspeed_m_s == state.airspeed_m_s
            ):
                self._flare.fly_slope(
                    state, height, -past_place, (flare_height, sink), self._wind, p, command
                )
        else:
            command.heading_rad = approach.course_rad
            command.height_rate_m_s = -sink
        if height <= max(flare_height, p.landing.latest_flare_share * p.flare_time_s * state.vel_down_m_s):
            self.phase = LandPhase.FLARE
            self._flare.begin(state, flare_height, sink, p)
        elif past_place > p.landing.missed_m or (height < p.landing.short_final_m and self._aside(ctx)):
            self._begin_go_around()

    def _aside(self, ctx: FlightContext) -> bool:
        """Too far beside the runway to land."""
        return ctx.position_valid and abs(self._line.offset_m(self._state)) > ctx.fixed_wing.landing.aside_m

    def _fly_flare(self, ctx: FlightContext, p: FixedWingFlightParameters) -> None:
        state, command, approach = self._state, self._command, self.approach
        assert approach is not None
        if ctx.position_valid:
            self._line.follow(state, self._path.of(ctx), command)
        else:
            command.heading_rad = approach.course_rad
        height = self._height(p, approach.down_m)
        self._follow_wind(ctx, height)
        self._limit_bank(p, height)
        to_go = math.nan
        if ctx.position_valid:
            to_go = -self._line.along_m(state)
            beyond = self._flare.touch_beyond_m(state, height, to_go, p)
            if (
                beyond > p.landing.beyond_s * p.landing_airspeed_m_s
                and height > p.landing.decided_m
                and self._may_go_around(p)
            ):
                self._go_arounds += 1
                self._begin_go_around()
                self._fly_go_around(ctx, p, approach)
                return
        touched = self._flare.fly(ctx, state, height, to_go, self._wind, p, command)
        if self._flare.aligning:
            command.steering_heading_rad = approach.course_rad
        if touched:
            self.phase = LandPhase.ROLL_OUT
            self._rolled_s = 0.0
            self._touch_pitch_rad = state.pitch_rad

    def _may_go_around(self, p: FixedWingFlightParameters) -> bool:
        """A gust that carries it too far is luck; an aircraft that floats every time has to come down."""
        return self._go_arounds < p.landing.go_arounds and p.trim_throttle > 0.0

    def _bounced(self, p: FixedWingFlightParameters) -> bool:
        """In the air again: a gust or the springs have lifted it; the flare sets it down once more."""
        measured = self._state.height_above_ground_m
        return (
            p.rangefinder_landing
            and self._rolled_s < p.landing.bounce_s
            and measured > p.standing_height_m + p.landing.bounced_m  # false for NaN
        )

    def _fly_roll_out(self, ctx: FlightContext, p: FixedWingFlightParameters) -> None:
        state, command = self._state, self._command
        self._rolled_s += ctx.dt_s
        command.roll_rad = 0.0
        # the nose comes down gently
        share = max(0.0, 1.0 - self._rolled_s / p.landing.nose_down_s)
        command.pitch_rad = p.takeoff_roll_pitch_rad + share * (
            self._touch_pitch_rad - p.takeoff_roll_pitch_rad
        )
        command.throttle = 0.0
        command.steering_heading_rad = self._line.steering_heading(state, ctx.position_valid)
        if self._rolled_s > p.landing.brake_after_s:
            command.brake = p.brake

    def abort_climb_m(self, p: FixedWingFlightParameters) -> float:
        """How high a go-around climbs before it turns."""
        return self._abort_climb_m if self._abort_climb_m > 0.0 else p.landing_abort_climb_m

    def _fly_go_around(self, ctx: FlightContext, p: FixedWingFlightParameters, approach: Approach) -> None:
        """Straight up along the runway, then back to where the approach begins; without power down ahead."""
        state, command = self._state, self._command
        height = self._height(p, approach.down_m)
        if self._power.powerless(state, ctx.dt_s) and height < p.landing.short_final_m:
            self._go_arounds = p.landing.go_arounds
            self.phase = LandPhase.FLARE
            ctx.phase = FlightPhase.LANDING
            self._flare.begin(state, height, state.ground_speed_m_s * approach.slope, p)
            self._fly_flare(ctx, p)
            return
        ctx.phase = FlightPhase.CRUISE
        self._line.follow(state, self._path.of(ctx), command)
        self._limit_bank(p, height)
        command.flaps = p.flaps_takeoff
        command.airspeed_m_s = p.takeoff_airspeed_m_s
        command.pitch_min_rad = p.takeoff_pitch_min_rad
        command.throttle = p.takeoff_throttle_max
        if approach.down_m - state.down_m >= self.abort_climb_m(p):
            self._flare.reset()
            self._enter_circle(ctx)
            ctx.phase = FlightPhase.LANDING
