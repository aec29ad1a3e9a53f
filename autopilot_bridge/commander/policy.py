"""What a flavour defines in the commander: boot timeline, mode rules, answers. Data, not code."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from types import MappingProxyType

from autopilot_bridge.commander.events import SystemStatus
from autopilot_bridge.commander.modes import MODE_NEEDS, FlightMode, Need
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.flight.plan_reading import PX4_PLANS, PlanRules


class MissionRestart(Enum):
    """When a stored mission restarts at its first item."""

    NEVER = auto()
    AFTER_LAST_ITEM = auto()  # at a disarm after its last item (PX4)
    AT_DISARM = auto()  # at every disarm (ArduCopter)


@dataclass(frozen=True, slots=True, kw_only=True)
class CommanderPolicy:
    """How one firmware runs the vehicle.

    Attributes:
        boot_mode: mode after power-up.
        heartbeat_start_s: time of the first heartbeat.
        boot_s: end of the boot phase (ArduPilot: system status BOOT until then).
        armable_s: earliest time at which the arming checks that need no position can pass.
        position_ready_s: earliest time at which the navigation solution counts as a position.
        home_s: earliest time at which home is set.
        home_at_liftoff: home is set when the vehicle leaves the ground, too, not only when it is armed (PX4).
        armable_modes: modes in which arming is allowed.
        ground_modes: modes that can be selected while disarmed.
        flown_modes: modes that can be entered in flight.
        kept_after_disarm: after disarming, the last commanded mode of these is restored (PX4); empty: the
            mode stays.
        takeoff_mode: take-off is a separate mode (PX4), not a task of GUIDED (ArduPilot).
        reposition_mode: mode in which the vehicle flies to a commanded place.
        mission_return_is_mode: a return item of a mission changes the mode (PX4).
        mission_waits_for_start: on the ground a mission starts on command only, not by being armed
            (ArduPilot).
        mission_first_item: 1 where item 0 is home (ArduPilot).
        manual_control_always: there is stick input without any sender (ArduPilot's simulated radio).
        recovers: the commanded mode is restored when a failsafe condition clears (PX4);
            else a failsafe is a normal mode change (ArduPilot).
        fallback_land: the mode that lands the vehicle when there is no position; None: none, the action's
            mode is flown anyway, by dead reckoning (ArduPlane).
        critical_on_warning: system status is CRITICAL for failsafes that only warn, too (ArduPilot).
        active_when_landed: system status is ACTIVE as soon as armed (PX4), not only in the air.
        standby_when_armable: system status is UNINIT while not armable in the commanded mode (PX4).
        preflight_disarm_extra_s: added to the automatic disarming before takeoff (PX4: spool-up).
        disarm_landed_everywhere: the short disarm after landing works in every mode (PX4), not only in the
            modes that land automatically.
        prearm_report_s: interval at which failing arming checks are announced without a request; 0: never.
        arming_denied, mode_denied, disarm_in_air_denied: results of refused requests.
        gcs_needed_to_arm: with a ground-station failsafe set, arming requires a ground station (PX4); else
            only a ground station that was connected and lost prevents arming.
        mode_needs: the requirements of each mode; ArduPlane flies most modes without a position, by dead
            reckoning.
        position_needed_to_arm: in every mode (ArduPlane), not only in those that need a position to fly.
        initialising_mode: shown until the boot phase is over (ArduPlane); None: the boot mode from the start.
        boot_status: MAV_STATE until then, where the policy does not use armability.
        takeoff_by_command: the command NAV_TAKEOFF starts a take-off (not on ArduPlane).
        orbit_mode: mode in which a commanded circle is flown; an aircraft holds by circling.
        failsafe_disarms_landed: a failsafe that acts on the ground stops the motors (ArduCopter).
        failsafe_lasts: the failsafe of a lost link lasts until the link is back, even if its own mode
            is exempt from that failsafe (ArduPlane).
        landing_ignores_links: a lost link does not end a landing (ArduPlane).
        radio_restores_mode: the mode is restored when the radio is back before the second stage of its
            failsafe (ArduPlane).
        ground_speed_apart: a commanded ground speed is not an airspeed (ArduPlane's minimum ground speed).
        plans: how it flies a plan.
        fence_in_status: SYS_STATUS shows the geofence (ArduPilot).
        fence_bounds_targets: a target position outside the geofence is refused (not on ArduPlane).
        gps_shown_when_used: SYS_STATUS shows the GPS only while its position may be used for flight (PX4);
            clients read the bit as that of the vehicle's position.
        mission_end_mode: mode after the last item of a mission, in the air; None: unchanged. A mode that is
            `kept_after_disarm` also follows a mission that ends on the ground, after disarming (PX4).
        mission_restart: when a mission restarts at its first item.
        landing_blocks_arming: a landing sequence that was begun prevents arming until mode or mission
            change, unless the mission starts with a take-off (ArduPlane).
        force_arm_skips_checks: the override number arms without checks, except the mandatory ones.
        always_commanded: modes that can be commanded in flight whatever they need (PX4's LAND, which then
            becomes a descent).
        same_mode_accepted: a command of the mode that is flown is accepted without checks (ArduPilot).
        mission_starts_with_takeoff: armed on the ground, the mission mode is refused for a mission that does
            not start with a take-off (ArduCopter).
        hand_throttle_modes: modes in which the throttle stick is the thrust. Armed on the ground they are
            refused while the stick would lift the vehicle, and only a change from one of them to another mode
            needs a height estimate (ArduCopter); empty: neither is looked at.
        arming_throttle_max: the highest throttle stick, -1..1, at which the vehicle can be armed in a mode;
            in other modes it does not matter to the mode.
        neutral_sticks_to_arm: in every mode the throttle stick must be down and the others centred
            (ArduPilot).
    """

    boot_mode: FlightMode
    heartbeat_start_s: float
    boot_s: float
    armable_s: float
    position_ready_s: float
    home_s: float
    home_at_liftoff: bool
    armable_modes: frozenset[FlightMode]
    ground_modes: frozenset[FlightMode]
    flown_modes: frozenset[FlightMode]
    kept_after_disarm: frozenset[FlightMode]
    takeoff_mode: FlightMode | None
    reposition_mode: FlightMode
    mission_return_is_mode: bool
    mission_waits_for_start: bool
    mission_first_item: int
    manual_control_always: bool
    recovers: bool
    fallback_land: FlightMode | None
    critical_on_warning: bool
    active_when_landed: bool
    standby_when_armable: bool
    preflight_disarm_extra_s: float
    disarm_landed_everywhere: bool
    prearm_report_s: float
    arming_denied: Result
    mode_denied: Result
    disarm_in_air_denied: Result
    gcs_needed_to_arm: bool
    force_arm_skips_checks: bool
    always_commanded: frozenset[FlightMode] = frozenset()
    same_mode_accepted: bool = False
    mission_starts_with_takeoff: bool = False
    hand_throttle_modes: frozenset[FlightMode] = frozenset()
    neutral_sticks_to_arm: bool = False
    arming_throttle_max: Mapping[FlightMode, float] = field(default_factory=lambda: MappingProxyType({}))
    mode_needs: Mapping[FlightMode, Need] = field(default_factory=lambda: MODE_NEEDS)
    position_needed_to_arm: bool = False
    initialising_mode: FlightMode | None = None
    boot_status: SystemStatus = SystemStatus.BOOT
    takeoff_by_command: bool = True
    orbit_mode: FlightMode = FlightMode.ORBIT
    failsafe_disarms_landed: bool = False
    failsafe_lasts: bool = False
    landing_ignores_links: bool = False
    radio_restores_mode: bool = False
    ground_speed_apart: bool = False
    mission_end_mode: FlightMode | None = None
    mission_restart: MissionRestart = MissionRestart.NEVER
    landing_blocks_arming: bool = False
    plans: PlanRules = PX4_PLANS
    fence_bounds_targets: bool = True
    fence_in_status: bool = False
    gps_shown_when_used: bool = False
