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
from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class LandDetectorParameters(Options):
    """Thresholds; PX4's names beside the fields."""

    vertical_speed_max_m_s: Positive = 0.25  # LNDMC_Z_VEL_MAX
    horizontal_speed_max_m_s: Positive = 1.5  # LNDMC_XY_VEL_MAX
    rotation_max_rad_s: Positive = math.radians(20.0)  # LNDMC_ROT_MAX
    contact_time_s: Positive = 0.35
    trigger_time_s: Positive = 1.0  # LNDMC_TRIG_TIME: maybe landed takes two thirds, landed a third
    low_thrust: Positive = 0.6  # share of hover thrust that can't carry the vehicle


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
        level = float(ctx.setpoint[sp.LEVEL])
        low_thrust = level <= sp.IDLE or thrust < p.low_thrust * ctx.hover_thrust
        touching = low_thrust or self._descending(ctx, level)
        touching = touching and not abs(float(ctx.nav[nav_layout.VEL + 2])) > p.vertical_speed_max_m_s
        # each stage needs the one before and its own time
        self._contact_s = self._contact_s + ctx.dt_s if touching else 0.0
        contact = self._contact_s >= p.contact_time_s
        still = contact and low_thrust and self._still(ctx)
        self._maybe_s = self._maybe_s + ctx.dt_s if still else 0.0
        maybe = self._maybe_s >= 2.0 / 3.0 * p.trigger_time_s
        self._landed_s = self._landed_s + ctx.dt_s if maybe else 0.0
        landed = self._landed_s >= p.trigger_time_s / 3.0
        if landed:
            self.state = LandedState.ON_GROUND
        elif ctx.phase is FlightPhase.TAKEOFF:
            self.state = LandedState.TAKEOFF
        elif ctx.phase is FlightPhase.LANDING:
            self.state = LandedState.LANDING
        else:
            self.state = LandedState.IN_AIR
        return self._store(ctx, contact, maybe)

    def _descending(self, ctx: FlightContext, level: float) -> bool:
        """The setpoint is well below."""
        wanted_down = float(ctx.setpoint[sp.VEL + 2])
        return level == sp.TRAJECTORY and wanted_down > 1.1 * self._parameters.vertical_speed_max_m_s

    def _still(self, ctx: FlightContext) -> bool:
        """It neither rotates nor moves horizontally, as far as known."""
        p = self._parameters
        rates, velocity = ctx.nav[nav_layout.RATES_FRD_RAD_S], ctx.nav[nav_layout.VEL_NED_M_S]
        if math.hypot(float(rates[0]), float(rates[1])) > p.rotation_max_rad_s:
            return False
        return not (
            ctx.velocity_valid
            and math.hypot(float(velocity[0]), float(velocity[1])) > p.horizontal_speed_max_m_s
        )

    def _falling(self, ctx: FlightContext) -> bool:
        return abs(float(ctx.nav[nav_layout.VEL_NED_M_S][2])) > 4.0 * self._parameters.vertical_speed_max_m_s

    def _store(self, ctx: FlightContext, contact: bool, maybe: bool) -> LandedState:
        if maybe and not ctx.armed:
            self.state = LandedState.ON_GROUND
        ctx.landed_state = self.state
        ctx.ground_contact = contact
        ctx.maybe_landed = maybe
        return self.state
