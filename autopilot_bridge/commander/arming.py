"""Arming checks, and whether a mode can be flown now. Pure functions of the situation."""

import math
from typing import Final

from autopilot_bridge.commander.events import BatteryLevel, FailsafeAction
from autopilot_bridge.commander.geofence_parameters import AutoEnable, FenceParameters
from autopilot_bridge.commander.modes import FlightMode, Need
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.commander.verdict import Reason

MAX_ARMING_TILT_RAD: Final = math.radians(30.0)

_THROTTLE_NEUTRAL: Final = -0.94
"""Throttle stick, -1..1: the dead zone of ArduPilot's channel (RC3_DZ 30 us) ends here."""
_CENTRED: Final = 0.04  # RC1_DZ 20 us
_NOT_CENTRED: Final = (Reason.ROLL_NOT_NEUTRAL, Reason.PITCH_NOT_NEUTRAL, Reason.YAW_NOT_NEUTRAL)
_AT_ARMING: Final = frozenset({Reason.THROTTLE_HIGH, Reason.THROTTLE_NOT_NEUTRAL, *_NOT_CENTRED})
"""Looked at only when a client arms."""

_MANDATORY: Final = frozenset(
    {
        Reason.MODE_NOT_ARMABLE,
        Reason.POSITION,
        Reason.TERMINATED,
        Reason.CALIBRATING,
        Reason.MISSION_MISSING,
        Reason.MISSION_INVALID,
    }
)
"""Requirements that hold even for a forced arming (ArduPilot; PX4 always checks everything)."""

MODE_REASONS: Final = frozenset({Reason.MODE_NOT_ARMABLE, Reason.MISSION_MISSING, Reason.MISSION_INVALID})
"""Reasons that depend on the selected mode, not on the vehicle."""


def shortfalls(
    mode: FlightMode, situation: Situation, policy: CommanderPolicy, parameters: CommanderParameters
) -> tuple[Reason, ...]:
    """The unmet requirements of a mode, in the order to resolve them; empty when it can be flown."""
    needs = policy.mode_needs[mode]
    health = situation.health
    reasons = []
    if Need.ATTITUDE in needs and not health.attitude:
        reasons.append(Reason.ATTITUDE)
    if Need.ALTITUDE in needs and not health.altitude:
        reasons.append(Reason.ALTITUDE)
    if Need.POSITION in needs and not situation.position:
        reasons.append(Reason.POSITION)
    if Need.HOME in needs and not situation.home_set:
        reasons.append(Reason.HOME)
    if Need.MANUAL_CONTROL in needs and situation.sticks_age_s > parameters.stick_timeout_s:
        reasons.append(Reason.MANUAL_CONTROL)
    if Need.MISSION in needs and situation.mission_problem is not None:
        reasons.append(situation.mission_problem)
    if Need.SETPOINTS in needs:
        if situation.setpoint_age_s > parameters.offboard_loss_s:
            reasons.append(Reason.NO_SETPOINTS)
        elif situation.setpoint_needs_position and not situation.position:
            reasons.append(Reason.POSITION)
    return tuple(reasons)


def mode_obstacle(
    mode: FlightMode,
    situation: Situation,
    policy: CommanderPolicy,
    parameters: CommanderParameters,
    *,
    flown: FlightMode,
    locked: bool,
) -> Reason | None:
    """Why a mode can't be commanded now: disarmed almost any can, armed its needs must be met.

    Args:
        flown: the mode that is flown.
        locked: the vehicle flies the action of a fence breach, in another mode.
    """
    if situation.terminated:
        return Reason.TERMINATED
    if mode is FlightMode.FOLLOW and not parameters.follow_enabled:
        return Reason.MODE_UNAVAILABLE
    if not situation.armed:
        return None if mode in policy.ground_modes else Reason.MODE_UNAVAILABLE
    if mode in policy.always_commanded or (policy.same_mode_accepted and mode is flown):
        return None
    if mode not in policy.flown_modes:
        return Reason.MODE_UNAVAILABLE
    by_hand, was_by_hand = mode in policy.hand_throttle_modes, flown in policy.hand_throttle_modes
    if by_hand and not was_by_hand and not situation.airborne and situation.throttle_lifts:
        return Reason.THROTTLE_HIGH
    missing = shortfalls(mode, situation, policy, parameters)
    if policy.hand_throttle_modes and not was_by_hand:
        missing = tuple(reason for reason in missing if reason is not Reason.ALTITUDE)
    first = missing[0] if missing else None
    if parameters.fence.locks_mode and locked and first not in (Reason.POSITION, Reason.ALTITUDE):
        return Reason.FENCE_RECOVERY
    if first is None and mode is FlightMode.MISSION and situation.takeoff_missing:
        return Reason.TAKEOFF_MISSING
    return first


def arming_reasons(
    mode: FlightMode,
    situation: Situation,
    policy: CommanderPolicy,
    parameters: CommanderParameters,
    *,
    forced: bool = False,
) -> tuple[Reason, ...]:
    """All reasons against arming in `mode`; empty when the vehicle may be armed.

    Args:
        forced: the client sent the override number; it skips checks only if the policy allows it.
    """
    reasons: list[Reason] = []
    health = situation.health
    if situation.terminated:
        reasons.append(Reason.TERMINATED)
    if situation.calibrating:
        reasons.append(Reason.CALIBRATING)
    if mode not in policy.armable_modes:
        reasons.append(Reason.MODE_NOT_ARMABLE)
    if not situation.ready:
        reasons.append(Reason.BOOTING)
    sensors = (
        (health.gyro, Reason.GYRO),
        (health.accelerometer, Reason.ACCELEROMETER),
        (health.barometer, Reason.BAROMETER),
        (health.magnetometer, Reason.COMPASS),
        (health.airspeed or not health.has_airspeed, Reason.AIRSPEED),
    )
    reasons.extend(reason for healthy, reason in sensors if not healthy)
    needs = policy.mode_needs[mode]
    by_position = Need.POSITION in needs or policy.position_needed_to_arm
    if not health.attitude:
        reasons.append(Reason.ATTITUDE)
    if by_position and not (health.gps or health.external):
        reasons.append(Reason.GPS)
    missing = shortfalls(mode, situation, policy, parameters)
    reasons.extend(reason for reason in missing if reason not in reasons)
    if by_position and not situation.position and Reason.POSITION not in reasons:
        reasons.append(Reason.POSITION)
    problem = situation.mission_problem
    if mode is FlightMode.MISSION and problem is not None and problem not in reasons:
        reasons.append(problem)
    if situation.landing_sequence:
        reasons.append(Reason.LANDING_SEQUENCE)
    if parameters.faults:
        reasons.append(Reason.PARAMETERS)
    if situation.battery_level >= BatteryLevel.CRITICAL:
        reasons.append(Reason.BATTERY_FAILSAFE)
    elif situation.battery_level >= BatteryLevel.LOW:
        reasons.append(Reason.BATTERY_LOW)
    reasons.extend(_fence_reasons(situation, parameters.fence))
    if not situation.tilt_rad < MAX_ARMING_TILT_RAD:  # NaN fails too
        reasons.append(Reason.LEANING)
    if situation.throttle > policy.arming_throttle_max.get(mode, math.inf):
        reasons.append(Reason.THROTTLE_HIGH)
    elif policy.neutral_sticks_to_arm:
        reasons.extend(
            reason
            for reason, stick in zip(_NOT_CENTRED, situation.centred_sticks, strict=True)
            if abs(stick) > _CENTRED
        )
        if situation.throttle > _THROTTLE_NEUTRAL:
            reasons.append(Reason.THROTTLE_NOT_NEUTRAL)
    expected = policy.gcs_needed_to_arm or math.isfinite(situation.gcs_age_s)
    lost = 0.0 < parameters.gcs_loss_s < situation.gcs_age_s
    if expected and lost and parameters.gcs_loss_action > FailsafeAction.WARN:
        reasons.append(Reason.GCS_LOST)
    if not parameters.check_arming or (forced and policy.force_arm_skips_checks):
        optional = frozenset() if Need.POSITION in needs else frozenset({Reason.POSITION})
        reasons = [reason for reason in reasons if reason in _MANDATORY - optional]
    return tuple(reasons)


def _fence_reasons(situation: Situation, fence: FenceParameters) -> list[Reason]:
    """The problems of the geofence, or of the vehicle's position relative to it."""
    if not fence.counts_breaches:
        return [Reason.OUTSIDE_FENCE] if situation.outside_fence else []
    watched = fence.enabled or fence.auto_enable is not AutoEnable.OFF
    reasons = []
    if fence.enabled and not situation.fence_present:
        reasons.append(Reason.FENCE_MISSING)
    low = fence.height_min_m if fence.floor else -math.inf
    both = fence.height_max_m > 0.0 and fence.height_max_m - low <= 2.0 * fence.margin_m
    if watched and (both or 0.0 < fence.radius_m < fence.margin_m):
        reasons.append(Reason.FENCE_PARAMETERS)
    if situation.outside_fence:
        reasons.append(Reason.OUTSIDE_FENCE)
    return reasons


class ArmingChecks:
    """Runs the arming checks and keeps their result.

    Attributes:
        reasons: all reasons against arming.
    """

    def __init__(self, policy: CommanderPolicy) -> None:
        self._policy = policy
        self._reported_us = 0
        self.reasons: tuple[Reason, ...] = (Reason.BOOTING,)

    @property
    def passed(self) -> bool:
        """No reason against arming; ArduPilot shows those that depend on the mode only when a client arms."""
        if self._policy.standby_when_armable:
            return not self.reasons
        return MODE_REASONS.issuperset(self.reasons)

    def run(
        self, mode: FlightMode, situation: Situation, parameters: CommanderParameters
    ) -> tuple[Reason, ...]:
        """Run the checks that are made all the time; returns the reasons against arming in a mode.

        The throttle stick is looked at only when a client arms.
        """
        reasons = arming_reasons(mode, situation, self._policy, parameters)
        self.reasons = tuple(reason for reason in reasons if reason not in _AT_ARMING)
        return self.reasons

    def report_due(self, time_us: int) -> bool:
        """It is time to repeat the report of the reasons against arming."""
        interval_us = self._policy.prearm_report_s * 1e6
        if interval_us <= 0.0 or self.passed or time_us - self._reported_us < interval_us:
            return False
        self._reported_us = time_us
        return True
