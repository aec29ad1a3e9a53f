"""ArduCopter 4.6.3 (docs/firmware/ardupilot.md, sections 1, 3 and 6)."""

from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import MODE_NEEDS, FlightMode, Need
from autopilot_bridge.commander.policy import CommanderPolicy, MissionRestart
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.ardupilot.copter import mapping as ardupilot_mapping
from autopilot_bridge.firmware.ardupilot.copter import modes as ardupilot_modes
from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.firmware.ardupilot.services import SERVICES, address_rule
from autopilot_bridge.firmware.ardupilot.texts import copter_notices
from autopilot_bridge.firmware.data import load_data, modes
from autopilot_bridge.firmware.external_mapping import ardupilot_gps_source
from autopilot_bridge.firmware.flavour import Flavour, Identity, Modes, SensorBits, Texts
from autopilot_bridge.firmware.mapping import airframe_overrides
from autopilot_bridge.firmware.texts import Notice, Severity
from autopilot_bridge.firmware.vehicle_classes import MULTICOPTER
from autopilot_bridge.flight.plan_reading import ARDUCOPTER_PLANS
from autopilot_bridge.mavlink.simulation_marks import FLIGHTSTACK_UID2
from flightsim.airframe import AirframeKind
from flightsim.foundation.firmware_frames import ArduPilotFrame

_MODES: Final = load_data("ardupilot.copter", "modes.toml")
_FLOWN: Final = modes(_MODES["flown"])
_GROUND_ONLY: Final = modes(_MODES["ground_only"])
"""Accepted on the ground as the firmware does; not flown here, so not armed in or entered in flight."""
_BY_HAND: Final = modes(_MODES["hand_throttle"])
_CLIMBS_BY_STICK: Final = frozenset({FlightMode.ALTITUDE, FlightMode.HOLD, FlightMode.POSHOLD})
_THROTTLE_DOWN: Final = -0.94  # dead zone of the channel
_CLIMBS_ABOVE: Final = 0.2  # THR_DZ

POLICY: Final = CommanderPolicy(
    boot_mode=FlightMode.STABILIZED,
    heartbeat_start_s=0.0,
    boot_s=3.0,
    armable_s=23.4,
    position_ready_s=41.5,
    home_s=19.9,
    home_at_liftoff=False,
    armable_modes=modes(_MODES["armable"]),
    ground_modes=_FLOWN | _GROUND_ONLY,
    flown_modes=_FLOWN,
    kept_after_disarm=frozenset(),
    takeoff_mode=None,
    reposition_mode=FlightMode.GUIDED,
    failsafe_disarms_landed=True,
    mission_return_is_mode=False,
    mission_waits_for_start=True,
    mission_first_item=1,
    manual_control_always=True,
    recovers=False,
    fallback_land=FlightMode.LAND,
    critical_on_warning=True,
    active_when_landed=False,
    standby_when_armable=False,
    preflight_disarm_extra_s=0.0,
    disarm_landed_everywhere=False,
    prearm_report_s=30.0,
    arming_denied=Result.FAILED,
    mode_denied=Result.FAILED,
    disarm_in_air_denied=Result.FAILED,
    gcs_needed_to_arm=False,
    mission_restart=MissionRestart.AT_DISARM,
    force_arm_skips_checks=True,
    same_mode_accepted=True,
    mission_starts_with_takeoff=True,
    hand_throttle_modes=_BY_HAND,
    neutral_sticks_to_arm=True,
    arming_throttle_max=MappingProxyType(
        {**dict.fromkeys(_BY_HAND, _THROTTLE_DOWN), **dict.fromkeys(_CLIMBS_BY_STICK, _CLIMBS_ABOVE)}
    ),
    mode_needs=MappingProxyType({mode: needs & ~Need.ATTITUDE for mode, needs in MODE_NEEDS.items()}),
    fence_in_status=True,
    plans=ARDUCOPTER_PLANS,
)

IDENTITY: Final = Identity(
    autopilot=3,  # MAV_AUTOPILOT_ARDUPILOTMEGA
    vehicle_type=2,  # MAV_TYPE_QUADROTOR
    sensor_bits=SensorBits(
        present=0x5371FC2F,
        enabled=0x52619C2F,
        enabled_armed=0x5361FC2F,
        health=0x57719C2F,
        health_armed=0x5771FC2F,
    ),
    product="ArduCopter V4.6.3 (3fc7011a)",
    capabilities=0xFBEF,
    flight_sw_version=0x040603FF,
    middleware_sw_version=0,
    os_sw_version=0,
    board_version=0,
    vendor_id=0,
    product_id=0,
    uid=0,
    flight_custom_version=b"3fc7011a",
    uid2=FLIGHTSTACK_UID2,
)


ARDUPILOT: Final = Flavour(
    identity=IDENTITY,
    modes=Modes(
        custom=ardupilot_modes.CUSTOM_MODES,
        names=ardupilot_modes.MODE_NAMES,
        base_mode=ardupilot_modes.base_mode,
    ),
    texts=Texts(
        notices=copter_notices,
        banner=(
            Notice(Severity.INFO, IDENTITY.product),
            Notice(Severity.INFO, "flightstack SITL"),
            Notice(Severity.INFO, "Frame: QUAD/X"),
        ),
        need_heartbeat=True,
        repeated_by_events=False,
    ),
    flight=MULTICOPTER,
    name="ardupilot",
    kind=AirframeKind.MULTICOPTER,
    policy=POLICY,
    command_address=address_rule,
    parameter_definitions=lambda: ARDUPILOT_PARAMETERS,
    airframe=airframe_overrides(MulticopterParameters(), ardupilot_mapping.CONTROLLER, ARDUPILOT_PARAMETERS),
    airframe_of=None,
    launch_parameters=MappingProxyType({}),
    commander_parameters=ardupilot_mapping.commander_parameters,
    flight_parameters=ardupilot_mapping.flight_parameters,
    controller_parameters=ardupilot_mapping.controller_parameters,
    navigation_parameters=ardupilot_mapping.navigation_parameters,
    frame_at=ArduPilotFrame,
    heartbeat_on_mode_change=True,
    reboot_starts_again=True,
    gps_source=ardupilot_gps_source,
    services=SERVICES,
)
