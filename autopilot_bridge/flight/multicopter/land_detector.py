"""Land detection in three stages with hysteresis, as PX4's `MulticopterLandDetector`.

Ground contact: low thrust, or a commanded descent without a descent, and no vertical motion.
Maybe landed: contact, low thrust, no rotation, no horizontal motion (if it is known).
Landed: maybe landed for the trigger time. In turbulence and in a free descent there is always some motion.
"""

import math
from dataclasses import dataclass

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase, LandedState
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.checks import check_fields, require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class LandDetectorParameters:
    """Thresholds; PX4's names beside the fields."""

    vertical_speed_max_m_s: float = 0.25  # LNDMC_Z_VEL_MAX
    horizontal_speed_max_m_s: float = 1.5  # LNDMC_XY_VEL_MAX
    rotation_max_rad_s: float = math.radians(20.0)  # LNDMC_ROT_MAX
    contact_time_s: float = 0.35
    trigger_time_s: float = 1.0  # LNDMC_TRIG_TIME: maybe landed and landed take two thirds and a third of it
    low_thrust: float = 0.6  # share of hover thrust that can't carry the vehicle

    def __post_init__(self) -> None:
        check_fields(self, require_positive)


class LandDetector:
    """Determines the landed state at the task rate.

    Args:
        parameters: thresholds.
        on_ground: the vehicle starts on the ground.

    Attributes:
        state: newest result.
    """

    def __init__(self, parameters: LandDetectorParameters | None = None, *, on_ground: bool = True) -> None:
        self._parameters = LandDetectorParameters() if parameters is None else parameters
        self._contact_s = self._maybe_s = self._landed_s = math.inf if on_ground else 0.0
        self.state = LandedState.ON_GROUND if on_ground else LandedState.IN_AIR

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        """Update, and write `landed_state`, `ground_contact` and `maybe_landed` of the context.

        Args:
            ctx: newest navigation state and the setpoint flown.
            thrust: collective thrust of the motors, 0..1 (`MulticopterController.thrust`).
        """
        p = self._parameters
        if not ctx.armed:
            # The motors do not turn: an unforced disarm happens on the ground only; after a forced one in the
            # air the vehicle is falling.
            if self.state is not LandedState.ON_GROUND and self._falling(ctx):
                return self._store(ctx, False, False)
            self._contact_s = self._maybe_s = self._landed_s = math.inf
            return self._store(ctx, True, True)
        velocity = ctx.nav[nav_layout.VEL_NED_M_S]
        rates = ctx.nav[nav_layout.RATES_FRD_RAD_S]
        setpoint = ctx.setpoint
        idle = bool(setpoint[sp.LEVEL] <= sp.IDLE)
        low_thrust = idle or thrust < p.low_thrust * ctx.hover_thrust
        vertical = abs(float(velocity[2])) > p.vertical_speed_max_m_s
        wanted_down = float(setpoint[sp.VEL + 2])
        descending = (
            bool(setpoint[sp.LEVEL] == sp.TRAJECTORY)
            and math.isfinite(wanted_down)
            and wanted_down > 1.1 * p.vertical_speed_max_m_s
        )
        horizontal = (
            ctx.velocity_valid
            and math.hypot(float(velocity[0]), float(velocity[1])) > p.horizontal_speed_max_m_s
        )
        rotating = math.hypot(float(rates[0]), float(rates[1])) > p.rotation_max_rad_s
        # each stage needs the one before and its own time
        contact = self._count(
            "_contact_s", (low_thrust or descending) and not vertical, p.contact_time_s, ctx.dt_s
        )
        still = contact and low_thrust and not rotating and not horizontal
        maybe = self._count("_maybe_s", still, 2.0 / 3.0 * p.trigger_time_s, ctx.dt_s)
        landed = self._count("_landed_s", maybe, p.trigger_time_s / 3.0, ctx.dt_s)
        if landed:
            self.state = LandedState.ON_GROUND
        elif ctx.phase is FlightPhase.TAKEOFF:
            self.state = LandedState.TAKEOFF
        elif ctx.phase is FlightPhase.LANDING:
            self.state = LandedState.LANDING
        else:
            self.state = LandedState.IN_AIR
        return self._store(ctx, contact, maybe)

    def _count(self, timer: str, condition: bool, needed_s: float, dt_s: float) -> bool:
        time_s: float = getattr(self, timer) + dt_s if condition else 0.0
        setattr(self, timer, time_s)
        return time_s >= needed_s

    def _falling(self, ctx: FlightContext) -> bool:
        return abs(float(ctx.nav[nav_layout.VEL_NED_M_S][2])) > 4.0 * self._parameters.vertical_speed_max_m_s

    def _store(self, ctx: FlightContext, contact: bool, maybe: bool) -> LandedState:
        if maybe and not ctx.armed:
            self.state = LandedState.ON_GROUND
        ctx.landed_state = self.state
        ctx.ground_contact = contact
        ctx.maybe_landed = maybe
        return self.state
