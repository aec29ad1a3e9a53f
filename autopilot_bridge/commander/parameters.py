"""The commander's parameters, in neutral names; flavours fill them from their own parameters."""

import math
from dataclasses import dataclass

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.modes import FlightMode
from flightsim.foundation.checks import NotNegativeOrInf
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class CommanderParameters(Options):
    """Timeouts, thresholds and actions of arming and failsafes.

    Attributes:
        offboard_loss_s: age of the last setpoint at which OFFBOARD counts as lost.
        gcs_loss_s, manual_loss_s: the same for ground-station heartbeats and for sticks; 0 disables it.
        gcs_loss_exempt, manual_loss_exempt: commanded modes that continue without that link.
        stick_timeout_s: age at which stick input expires.
        action_delay_s: time for which a link failsafe holds before it acts, so that the pilot can take over.
        battery_*_remaining: remaining fraction below which the level is reached; 0 disables it.
        battery_*_v: voltage below which the level is reached after `battery_timer_s`; 0 disables it.
        position_loss_s: how long the filter may be without a position before the failsafe acts.
        position_accuracy_max_m: with a worse 1-sigma accuracy there is no position (2.5 times this value
            once there was one); infinite: never.
        position_accuracy_low_m: with a worse accuracy a mission and a hold end; 0 disables it.
        manual_long_loss_*: a second stage of lost sticks (ArduPlane); 0 s disables it.
        attitude_roll_max_rad, attitude_pitch_max_rad: beyond these for `attitude_time_s` the attitude is
            excessive; 0 disables it.
        fence: the geofence.
        disarm_preflight_s, disarm_landed_s: automatic disarming; 0 or less disables it.
        stick_override: moved sticks end automatic flight (PX4 COM_RC_OVERRIDE, bit 0).
        stick_override_offboard: they also end OFFBOARD (bit 1).
        stick_override_threshold: stick travel, 0..1, that counts as moved.
        crash_check: a vehicle that has crashed is disarmed (FS_CRASH_CHECK).
        follow_enabled: the mode that follows a target can be selected (FOLL_ENABLE).
        check_arming: False skips the optional arming checks.
        faults: values with which the firmware does not arm, in its words.
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
    position_accuracy_max_m: NotNegativeOrInf = math.inf
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
    faults: tuple[str, ...] = ()
