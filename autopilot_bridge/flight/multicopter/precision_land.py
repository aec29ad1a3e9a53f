"""Land at a target measured by a detector: PX4's Precision Land, ArduCopter's LAND with PLND_ENABLED.

The vehicle flies above the target, then descends while the target is below it. The flavour defines what
happens when the target is lost on the way, or never seen (`PrecisionParameters.lost`). The end of the
descent, and the whole descent without a target, is a normal landing.
"""

import math
from enum import IntEnum
from typing import Final

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.multicopter.land import LandTask, descent_speed
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.surroundings_parameters import Precision, PrecisionParameters, TargetLost
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as nav_layout

_CONE: Final = 0.15  # the allowed offset grows with the height: m per m
_AWAY: Final = 2.0  # the descent pauses at this multiple of the allowed offset
_GAIN_1_S: Final = 0.8
_BRAKE_SHARE: Final = 0.5
_NAV_HEIGHT: Final = nav_layout.HEIGHT_ABOVE_GROUND_M
_FIRST_LOOK_S: Final = 3.0  # after this time without a detection, no target is in sight
_SLOWEST_LAND_M_S: Final = 0.3


class PrecisionPhase(IntEnum):
    """The phase of the landing."""

    LOOK = 0  # no detection yet
    ALIGN = 1  # over the target
    DESCEND = 2
    SEARCH = 3
    HOVER = 4
    FINAL = 5  # a normal landing from here on


class PrecisionLandTask:
    """The landing; DONE on the ground.

    Args:
        position_ned_m: approximate position of the target, (3,) (down is ignored); None: here.
        yaw_rad: heading; None: the present one.
        required: search for the target (PX4 NAV_LAND param2 2); else a normal landing if it is not seen.

    Attributes:
        phase: see `PrecisionPhase`.
    """

    def __init__(
        self, position_ned_m: Array | None = None, yaw_rad: float | None = None, *, required: bool = True
    ) -> None:
        self._place = None if position_ned_m is None else np.array(position_ned_m, dtype=np.float64)
        self._yaw_rad = math.nan if yaw_rad is None else yaw_rad
        self._required = required
        self._motion: SmoothMotion | None = None
        self._land: LandTask | None = None
        self._since_s = 0.0
        self._searches = 0
        self._lost_down_m = math.nan
        self.phase = PrecisionPhase.LOOK

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.LANDING
        self._motion = SmoothMotion(ctx)
        self._land = None
        self._searches = 0
        self._lost_down_m = math.nan
        self._go(PrecisionPhase.LOOK)
        if self._place is not None:
            self._place[2] = self._motion.trajectory.position_ned_m[2]

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion = self._motion
        if motion is None:
            self.activate(ctx)
            return self.update(ctx)
        if self._land is not None:
            return self._land.update(ctx)
        if not ctx.armed or ctx.on_ground or ctx.ground_contact or not ctx.position_valid:
            return self._land_plainly(ctx, None)
        self._since_s += ctx.dt_s
        motion.synchronise(ctx)
        p = ctx.multicopter.precision
        height_m = self._height(ctx)
        track = ctx.surroundings.landing_target
        seen = track.place(ctx.time_us) if height_m <= p.greatest_m else None
        if seen is not None and height_m <= max(p.final_m, 0.0) + 1e-9:
            return self._land_plainly(ctx, seen)
        if seen is None:
            status = self._without_target(ctx, motion, p, height_m)
            if status is not None:
                return status
        else:
            self._over_target(ctx, motion, p, height_m, seen)
        motion.steer(ctx, motion.heading.yaw_rad if math.isnan(self._yaw_rad) else self._yaw_rad)
        motion.write(ctx)
        if self.phase is PrecisionPhase.DESCEND:
            ctx.setpoint[sp.POS_NED_M][2] = math.nan  # by speed alone: the height of the ground is not known
            ctx.setpoint[sp.ACC_NED_M_S2][2] = 0.0
        return TaskStatus.RUNNING

    def _go(self, phase: PrecisionPhase) -> None:
        self.phase = phase
        self._since_s = 0.0

    def _height(self, ctx: FlightContext) -> float:
        height_m = float(ctx.nav[_NAV_HEIGHT])
        return ctx.height_above_home_m if math.isnan(height_m) else height_m

    def _land_plainly(self, ctx: FlightContext, place: tuple[float, float] | None) -> TaskStatus:
        """Fly the rest as a normal landing; at the target while its position is known."""
        self._go(PrecisionPhase.FINAL)
        where = None if place is None else np.array([place[0], place[1], math.nan])
        yaw_rad = None if math.isnan(self._yaw_rad) else self._yaw_rad
        self._land = LandTask(where, yaw_rad)
        self._land.activate(ctx)
        return self._land.update(ctx)

    def _over_target(
        self,
        ctx: FlightContext,
        motion: SmoothMotion,
        p: PrecisionParameters,
        height_m: float,
        seen: tuple[float, float],
    ) -> None:
        """Fly above the target, and descend while it is below."""
        north = seen[0] - float(ctx.nav[nav_layout.POS_NED_M][0])
        east = seen[1] - float(ctx.nav[nav_layout.POS_NED_M][1])
        off_m = math.hypot(north, east)
        allowed_m = p.align_m + _CONE * height_m
        if self.phase is not PrecisionPhase.DESCEND:
            if self.phase is not PrecisionPhase.ALIGN:
                self._go(PrecisionPhase.ALIGN)
            if off_m < allowed_m:
                self._go(PrecisionPhase.DESCEND)
        elif off_m > _AWAY * allowed_m:
            self._go(PrecisionPhase.ALIGN)
        self._lost_down_m = float(motion.trajectory.position_ned_m[2])
        sink = 0.0
        if self.phase is PrecisionPhase.DESCEND:
            sink = max(_SLOWEST_LAND_M_S, descent_speed(height_m, ctx.multicopter))
        self._approach(ctx, motion, seen, sink)

    def _approach(
        self, ctx: FlightContext, motion: SmoothMotion, place: tuple[float, float], sink_m_s: float
    ) -> None:
        trajectory = motion.trajectory
        north = place[0] - float(trajectory.position_ned_m[0])
        east = place[1] - float(trajectory.position_ned_m[1])
        away = math.hypot(north, east)
        closing = min(
            _GAIN_1_S * away,
            math.sqrt(2.0 * _BRAKE_SHARE * ctx.multicopter.acceleration_m_s2 * away),
            ctx.multicopter.cruise_speed_m_s,
        )
        scale = closing / away if away > 1e-6 else 0.0
        trajectory.stretch = 1.0
        trajectory.track_velocity(scale * north, scale * east, sink_m_s, ctx.dt_s)

    def _without_target(
        self, ctx: FlightContext, motion: SmoothMotion, p: PrecisionParameters, height_m: float
    ) -> TaskStatus | None:
        """Fly to the expected position, wait, search, or land; returns a status when the landing took
        over.
        """
        if self.phase in (PrecisionPhase.ALIGN, PrecisionPhase.DESCEND):
            if height_m <= p.final_m:
                return self._land_plainly(ctx, None)
            if ctx.surroundings.landing_target.age_s(ctx.time_us) <= p.wait_s:
                motion.brake(ctx)
                return None
            return self._after_loss(ctx, motion, p)
        if self.phase is PrecisionPhase.LOOK:
            if height_m > p.greatest_m:
                self._sinks(ctx, motion)
                return None
            if not self._at_place(ctx, motion):
                self._since_s = 0.0
            elif self._since_s > _FIRST_LOOK_S:
                return self._after_loss(ctx, motion, p)
            return None
        if self.phase is PrecisionPhase.SEARCH:
            if not self._climbs(ctx, motion, p):
                self._since_s = 0.0
            elif self._since_s > p.search_s:
                return self._after_loss(ctx, motion, p)
            return None
        motion.brake(ctx)
        return None

    def _after_loss(
        self, ctx: FlightContext, motion: SmoothMotion, p: PrecisionParameters
    ) -> TaskStatus | None:
        lost = p.lost
        if lost is TargetLost.HOVER and self._required:
            self._go(PrecisionPhase.HOVER)
            motion.brake(ctx)
            return None
        if lost is TargetLost.LAND or not self._required or self._searches >= p.searches:
            return self._land_plainly(ctx, None)
        self._searches += 1
        self._go(PrecisionPhase.SEARCH)
        motion.begin_leg()
        self._climbs(ctx, motion, p)
        return None

    def _at_place(self, ctx: FlightContext, motion: SmoothMotion) -> bool:
        """Fly to the approximate position of the target; True when the vehicle is there."""
        if self._place is None:
            motion.brake(ctx)
            return motion.stopped
        motion.fly_to(ctx, self._place)
        here = ctx.nav[nav_layout.POS_NED_M]
        return math.hypot(float(self._place[0] - here[0]), float(self._place[1] - here[1])) < 1.0

    def _sinks(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        """Descend: the vehicle is too high for a detection."""
        here = motion.trajectory.position_ned_m if self._place is None else self._place
        place = (float(here[0]), float(here[1]))
        self._approach(ctx, motion, place, ctx.multicopter.land_descend_speed_m_s)

    def _climbs(self, ctx: FlightContext, motion: SmoothMotion, p: PrecisionParameters) -> bool:
        """Climb to the height of the search; True when the vehicle is there."""
        home_down = float(ctx.home_ned_m[2])
        down = (0.0 if math.isnan(home_down) else home_down) - p.search_m
        if math.isnan(down):
            down = self._lost_down_m
        here = motion.trajectory.position_ned_m
        if math.isnan(down) or down > float(here[2]):
            down = float(here[2])  # never descend for a search
        error = down - float(here[2])
        speed = max(-ctx.multicopter.climb_speed_m_s, _GAIN_1_S * error)
        motion.trajectory.stretch = 1.0
        motion.trajectory.track_velocity(0.0, 0.0, speed, ctx.dt_s)
        return abs(error) < 0.5


def landing_task(
    ctx: FlightContext,
    position_ned_m: Array | None = None,
    yaw_rad: float | None = None,
    *,
    precision: Precision = Precision.NONE,
) -> LandTask | PrecisionLandTask:
    """A landing at a position (None: here), with a precision landing where required."""
    if precision is Precision.NONE and not ctx.multicopter.precision.enabled:
        return LandTask(position_ned_m, yaw_rad)
    return PrecisionLandTask(position_ned_m, yaw_rad, required=precision is not Precision.OPPORTUNISTIC)
