"""ArduPlane 4.6.3 (docs/firmware/ardupilot.md, sections 1, 3 and 7)."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.events import SystemStatus
from autopilot_bridge.commander.modes import MODE_NEEDS, FlightMode, Need
from autopilot_bridge.commander.policy import CommanderPolicy, MissionRestart
from autopilot_bridge.firmware.ardupilot.copter.flavour import ARDUPILOT
from autopilot_bridge.firmware.ardupilot.copter.flavour import POLICY as MULTICOPTER_POLICY
from autopilot_bridge.firmware.ardupilot.plane import mapping as ardupilot_plane_mapping
from autopilot_bridge.firmware.ardupilot.plane import modes as ardupilot_plane_modes
from autopilot_bridge.firmware.ardupilot.plane.parameters import ARDUPILOT_PLANE_PARAMETERS
from autopilot_bridge.firmware.ardupilot.services import PLANE_SERVICES
from autopilot_bridge.firmware.ardupilot.texts import plane_notices
from autopilot_bridge.firmware.data import load_data, modes
from autopilot_bridge.firmware.flavour import Modes, SensorBits
from autopilot_bridge.firmware.texts import Notice, Severity
from autopilot_bridge.firmware.vehicle_classes import FIXED_WING
from autopilot_bridge.flight.plan_reading import ARDUPLANE_PLANS
from flightsim.airframe import AirframeKind, LaunchKind

_MODES: Final = load_data("ardupilot.plane", "modes.toml")
_FLOWN: Final = modes(_MODES["flown"])
_NOT_ARMABLE: Final = frozenset({FlightMode.RETURN})

MODE_NEEDS_BY_DEAD_RECKONING: Final[Mapping[FlightMode, Need]] = MappingProxyType(
    {mode: needs & ~(Need.POSITION | Need.MISSION) for mode, needs in MODE_NEEDS.items()}
)
"""ArduPlane refuses no mode in flight without a position: it then continues by dead reckoning."""

POLICY: Final[CommanderPolicy] = replace(
    MULTICOPTER_POLICY,
    boot_mode=FlightMode.MANUAL,
    boot_s=1.7,
    armable_s=1.7,
    position_ready_s=20.4,
    home_s=19.4,
    armable_modes=_FLOWN - _NOT_ARMABLE,
    ground_modes=_FLOWN,
    flown_modes=_FLOWN,
    mission_starts_with_takeoff=False,
    hand_throttle_modes=frozenset(),
    arming_throttle_max=MappingProxyType({}),
    failsafe_disarms_landed=False,
    mission_return_is_mode=True,
    mission_waits_for_start=False,
    fallback_land=None,
    mode_needs=MODE_NEEDS_BY_DEAD_RECKONING,
    position_needed_to_arm=True,
    initialising_mode=FlightMode.INITIALISING,
    boot_status=SystemStatus.CALIBRATING,
    takeoff_by_command=False,
    orbit_mode=FlightMode.HOLD,
    failsafe_lasts=True,
    landing_ignores_links=True,
    radio_restores_mode=True,
    ground_speed_apart=True,
    mission_end_mode=FlightMode.RETURN,
    mission_restart=MissionRestart.NEVER,
    landing_blocks_arming=True,
    plans=ARDUPLANE_PLANS,
    fence_bounds_targets=False,
)

IDENTITY: Final = replace(
    ARDUPILOT.identity,
    vehicle_type=1,  # MAV_TYPE_FIXED_WING
    sensor_bits=SensorBits(
        present=0x1361FC3F,
        enabled=0x1261803F,
        enabled_armed=0x1361FC3F,
        health=0x1331803F,
        health_armed=0x1331FC3F,
    ),
    product="ArduPlane V4.6.3 (3fc7011a)",
    capabilities=0xF36F,
    flight_sw_version=0x040603FF,
)

LAUNCH_PARAMETERS: Final[Mapping[LaunchKind, Mapping[str, float]]] = MappingProxyType(
    {
        LaunchKind.RUNWAY: MappingProxyType({"TKOFF_THR_MINACC": 0.0, "TKOFF_THR_DELAY": 2.0}),
        LaunchKind.CATAPULT: MappingProxyType({"TKOFF_THR_MINACC": 15.0, "TKOFF_THR_DELAY": 2.0}),
        LaunchKind.HAND: MappingProxyType({"TKOFF_THR_MINACC": 9.0, "TKOFF_THR_DELAY": 2.0}),
    }
)

ARDUPILOT_PLANE: Final = replace(
    ARDUPILOT,
    identity=IDENTITY,
    modes=Modes(
        custom=ardupilot_plane_modes.CUSTOM_MODES,
        names=ardupilot_plane_modes.MODE_NAMES,
        base_mode=ardupilot_plane_modes.base_mode,
    ),
    texts=replace(
        ARDUPILOT.texts,
        notices=plane_notices,
        need_heartbeat=False,
        banner=(Notice(Severity.INFO, IDENTITY.product), Notice(Severity.INFO, "flightstack SITL")),
    ),
    flight=FIXED_WING,
    kind=AirframeKind.FIXED_WING,
    policy=POLICY,
    parameter_definitions=lambda: ARDUPILOT_PLANE_PARAMETERS,
    airframe=MappingProxyType({}),
    airframe_of=ardupilot_plane_mapping.airframe_overrides,
    launch_parameters=LAUNCH_PARAMETERS,
    commander_parameters=ardupilot_plane_mapping.commander_parameters,
    flight_parameters=ardupilot_plane_mapping.flight_parameters,
    controller_parameters=ardupilot_plane_mapping.controller_parameters,
    navigation_parameters=ardupilot_plane_mapping.navigation_parameters,
    services=PLANE_SERVICES,
)
