"""PX4 v1.16.1 for a fixed wing (docs/firmware/px4.md, sections 3 to 9)."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.flavour import Modes, SensorBits
from autopilot_bridge.firmware.px4.copter.flavour import POLICY as MULTICOPTER_POLICY
from autopilot_bridge.firmware.px4.copter.flavour import PX4
from autopilot_bridge.firmware.px4.plane import mapping as px4_plane_mapping
from autopilot_bridge.firmware.px4.plane import modes as px4_plane_modes
from autopilot_bridge.firmware.px4.plane.parameters import PX4_PLANE_PARAMETERS
from autopilot_bridge.firmware.px4.services import PLANE_SERVICES
from autopilot_bridge.firmware.px4.texts import plane_notices
from autopilot_bridge.firmware.vehicle_classes import FIXED_WING
from flightsim.airframe import AirframeKind, LaunchKind

_SELECTABLE: Final = MULTICOPTER_POLICY.ground_modes - px4_plane_modes.MULTICOPTER_ONLY
_ARMABLE: Final = MULTICOPTER_POLICY.armable_modes - px4_plane_modes.MULTICOPTER_ONLY

POLICY: Final = replace(
    MULTICOPTER_POLICY,
    armable_modes=_ARMABLE,
    ground_modes=_SELECTABLE,
    flown_modes=_SELECTABLE - {FlightMode.FOLLOW},  # an aircraft follows no target
    kept_after_disarm=_ARMABLE,
    preflight_disarm_extra_s=0.0,
    orbit_mode=FlightMode.HOLD,  # Orbit is a multicopter's mode; an aircraft circles in Hold
)

LAUNCH_PARAMETERS: Final[Mapping[LaunchKind, Mapping[str, float]]] = MappingProxyType(
    {
        LaunchKind.RUNWAY: MappingProxyType({"RWTO_TKOFF": 1.0, "FW_LAUN_DETCN_ON": 0.0}),
        LaunchKind.CATAPULT: MappingProxyType({"RWTO_TKOFF": 0.0, "FW_LAUN_DETCN_ON": 1.0}),
        LaunchKind.HAND: MappingProxyType({"RWTO_TKOFF": 0.0, "FW_LAUN_DETCN_ON": 1.0}),
    }
)

IDENTITY: Final = replace(
    PX4.identity,
    vehicle_type=1,  # MAV_TYPE_FIXED_WING
    sensor_bits=SensorBits(  # as the recorded flight of the aircraft shows them
        present=0x0300403F,
        enabled=0x0301403F,
        enabled_armed=0x0301403F,
        health=0x1320C83F,
        health_armed=0x1320C83F,
    ),
)

PX4_PLANE: Final = replace(
    PX4,
    identity=IDENTITY,
    modes=Modes(
        custom=px4_plane_modes.CUSTOM_MODES,
        names=px4_plane_modes.MODE_NAMES,
        base_mode=px4_plane_modes.base_mode,
        listed=px4_plane_modes.LISTED_MODES,
    ),
    texts=replace(PX4.texts, notices=plane_notices),
    flight=FIXED_WING,
    kind=AirframeKind.FIXED_WING,
    policy=POLICY,
    parameter_definitions=lambda: PX4_PLANE_PARAMETERS,
    airframe=MappingProxyType({}),
    airframe_of=px4_plane_mapping.airframe_overrides,
    launch_parameters=LAUNCH_PARAMETERS,
    commander_parameters=px4_plane_mapping.commander_parameters,
    flight_parameters=px4_plane_mapping.flight_parameters,
    controller_parameters=px4_plane_mapping.controller_parameters,
    navigation_parameters=px4_plane_mapping.navigation_parameters,
    services=PLANE_SERVICES,
)
