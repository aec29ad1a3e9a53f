"""What a pilot may tune in the commander, in neutral names; flavours fill it from their own parameters."""

import math
from dataclasses import dataclass

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.modes import FlightMode
from flightsim.checks import check_fields, require_finite


@dataclass(frozen=True, slots=True, kw_only=True)
class CommanderParameters:
    """Time-outs, thresholds and actions of arming and failsafes.

    Attributes:
        offboard_loss_s: age of the last setpoint at which OFFBOARD counts as lost.
        gcs_loss_s, manual_loss_s: the same for ground-station heartbeats and for sticks; 0 switches it off.
        gcs_loss_exempt, manual_loss_exempt: commanded modes that fly on without that link.
        stick_timeout_s: age at which stick input is forgotten.
        action_delay_s: hold this long before a link failsafe acts, so that a person can step in.
        battery_*_remaining: remaining fraction below which the level is reached; 0 switches it off.
        battery_*_v: voltage below which the level is reached after `battery_timer_s`; 0 switches it off.
        position_loss_s: how long the filter may be without a position before the failsafe acts.
        position_accuracy_max_m: with a worse 1-sigma accuracy there is no position (twice and a half of it
            once there was one); infinite: never.
        position_accuracy_low_m: worse than this a mission and a hold end; 0 switches it off.
        manual_long_loss_*: a second stage of lost sticks (ArduPlane); 0 s switches it off.
        attitude_roll_max_rad, attitude_pitch_max_rad: beyond them for `attitude_time_s` the attitude is
            excessive; 0 switches it off.
        fence: the geofence.
        disarm_preflight_s, disarm_landed_s: automatic disarming; 0 or less switches it off.
        stick_override: moved sticks take over from automatic flight (PX4 COM_RC_OVERRIDE, bit 0).
        stick_override_offboard: and from OFFBOARD (bit 1).
        stick_override_threshold: stick travel, 0..1, that counts as moved.
        crash_check: a vehicle that has crashed is disarmed (FS_CRASH_CHECK).
        follow_enabled: the mode that follows a target may be chosen (FOLL_ENABLE).
        check_arming: False skips the arming checks that may be skipped.
    """

    offboard_loss_s: float
    offboard_loss_action: FailsafeAction
    gcs_loss_s: float
    gcs_loss_action: FailsafeAction
    gcs_loss_exempt: frozenset[FlightMode]
    stick_timeout_s: float
    manual_loss_s: float
    manual_loss_action: FailsafeAction
    manual_loss_exempt: frozenset[FlightMode]
    action_delay_s: float
    battery_low_remaining: float
    battery_critical_remaining: float
    battery_emergency_remaining: float
    battery_low_v: float
    battery_critical_v: float
    battery_timer_s: float
    battery_low_action: FailsafeAction
    battery_critical_action: FailsafeAction
    battery_emergency_action: FailsafeAction
    position_loss_s: float
    position_loss_action: FailsafeAction
    fence: FenceParameters
    disarm_preflight_s: float
    disarm_landed_s: float
    stick_override: bool
    stick_override_offboard: bool
    stick_override_threshold: float
    check_arming: bool
    position_accuracy_max_m: float = math.inf
    position_accuracy_low_m: float = 0.0
    position_accuracy_low_action: FailsafeAction = FailsafeAction.NONE
    manual_long_loss_s: float = 0.0
    manual_long_loss_action: FailsafeAction = FailsafeAction.NONE
    manual_long_loss_exempt: frozenset[FlightMode] = frozenset()
    attitude_roll_max_rad: float = 0.0
    attitude_pitch_max_rad: float = 0.0
    attitude_time_s: float = 0.3
    attitude_action: FailsafeAction = FailsafeAction.NONE
    crash_check: bool = False
    follow_enabled: bool = True

    def __post_init__(self) -> None:
        check_fields(self, require_finite, unlimited=("position_accuracy_max_m",))
