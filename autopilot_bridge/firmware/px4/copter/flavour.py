"""PX4 v1.16.1 for a multicopter (docs/firmware/px4.md, sections 3 to 9)."""

from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.policy import CommanderPolicy, MissionRestart
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.data import load_data, modes
from autopilot_bridge.firmware.flavour import Flavour, Identity, Modes, SensorBits, Texts
from autopilot_bridge.firmware.mapping import airframe_overrides
from autopilot_bridge.firmware.px4.copter import mapping as px4_mapping
from autopilot_bridge.firmware.px4.copter import modes as px4_modes
from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.firmware.px4.services import SERVICES
from autopilot_bridge.firmware.px4.texts import copter_notices
from autopilot_bridge.firmware.vehicle_classes import MULTICOPTER
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.simulation_marks import PX4_SITL_UID
from autopilot_bridge.services.channel import AddressRule
from flightsim.airframe import AirframeKind
from flightsim.foundation.firmware_frames import Px4Frame

_MODES: Final = load_data("px4.copter", "modes.toml")
_SELECTABLE: Final = modes(_MODES["selectable"])
_PREVENT_ARMING: Final = modes(_MODES["prevent_arming"])
_BY_HAND: Final = frozenset({FlightMode.MANUAL, FlightMode.STABILIZED, FlightMode.ACRO})
_CLIMBS_BY_STICK: Final = frozenset({FlightMode.ALTITUDE, FlightMode.POSITION, FlightMode.POSITION_SLOW})
_THROTTLE_LOW, _THROTTLE_CENTER = -0.8, 0.2

POLICY: Final = CommanderPolicy(
    boot_mode=FlightMode.HOLD,
    heartbeat_start_s=1.1,
    boot_s=2.1,
    armable_s=3.66,
    position_ready_s=3.66,
    home_s=3.03,
    home_at_liftoff=True,
    armable_modes=_SELECTABLE - _PREVENT_ARMING,
    ground_modes=_SELECTABLE,
    flown_modes=_SELECTABLE,
    kept_after_disarm=_SELECTABLE - _PREVENT_ARMING,
    takeoff_mode=FlightMode.TAKEOFF,
    reposition_mode=FlightMode.HOLD,
    mission_return_is_mode=True,
    mission_waits_for_start=False,
    mission_first_item=0,
    manual_control_always=False,
    recovers=True,
    fallback_land=FlightMode.DESCEND,
    critical_on_warning=False,
    active_when_landed=True,
    standby_when_armable=True,
    preflight_disarm_extra_s=1.0,
    disarm_landed_everywhere=True,
    prearm_report_s=0.0,
    arming_denied=Result.TEMPORARILY_REJECTED,
    mode_denied=Result.TEMPORARILY_REJECTED,
    disarm_in_air_denied=Result.TEMPORARILY_REJECTED,
    gcs_needed_to_arm=True,
    force_arm_skips_checks=False,
    always_commanded=frozenset({FlightMode.LAND}),
    arming_throttle_max=MappingProxyType(
        {**dict.fromkeys(_BY_HAND, _THROTTLE_LOW), **dict.fromkeys(_CLIMBS_BY_STICK, _THROTTLE_CENTER)}
    ),
    gps_shown_when_used=True,
    mission_end_mode=FlightMode.HOLD,
    mission_restart=MissionRestart.AFTER_LAST_ITEM,
)

IDENTITY: Final = Identity(
    autopilot=12,  # MAV_AUTOPILOT_PX4
    vehicle_type=2,  # MAV_TYPE_QUADROTOR
    sensor_bits=SensorBits(
        present=0x0300402F,
        enabled=0x0301402F,
        enabled_armed=0x0301402F,
        health=0x1320C83F,
        health_armed=0x1320C83F,
    ),
    product="PX4 Autopilot v1.16.1",
    capabilities=0xE8FF,
    flight_sw_version=0x011001FF,
    middleware_sw_version=0x011001FF,
    os_sw_version=0,
    board_version=1,
    vendor_id=0,
    product_id=0,
    uid=PX4_SITL_UID,
    flight_custom_version=(bytes.fromhex("94cb2012") + bytes(4))[::-1],
    uid2=bytes(18),
)


def _command_address(system_id: int) -> AddressRule:
    return AddressRule(system_id=system_id, component_ids=frozenset({AUTOPILOT_COMPONENT}), any_system=False)


PX4: Final = Flavour(
    identity=IDENTITY,
    modes=Modes(
        custom=px4_modes.CUSTOM_MODES,
        names=px4_modes.MODE_NAMES,
        base_mode=px4_modes.base_mode,
        listed=px4_modes.LISTED_MODES,
    ),
    texts=Texts(notices=copter_notices, banner=(), need_heartbeat=False, repeated_by_events=True),
    flight=MULTICOPTER,
    name="px4",
    kind=AirframeKind.MULTICOPTER,
    policy=POLICY,
    command_address=_command_address,
    parameter_definitions=lambda: PX4_PARAMETERS,
    airframe=airframe_overrides(MulticopterParameters(), px4_mapping.CONTROLLER, PX4_PARAMETERS),
    airframe_of=None,
    launch_parameters=MappingProxyType({}),
    commander_parameters=px4_mapping.commander_parameters,
    flight_parameters=px4_mapping.flight_parameters,
    controller_parameters=px4_mapping.controller_parameters,
    navigation_parameters=px4_mapping.navigation_parameters,
    frame_at=Px4Frame,
    heartbeat_on_mode_change=False,
    services=SERVICES,
)
