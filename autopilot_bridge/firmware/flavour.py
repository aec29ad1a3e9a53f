"""The shape of a flavour: everything in which one firmware differs from another, as data and functions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.vehicle_tasks import LandDetector, VehicleTasks
from autopilot_bridge.control.controller import Array, Controller
from autopilot_bridge.firmware.external_mapping import GpsSource, own_receiver
from autopilot_bridge.firmware.services import FirmwareServices
from autopilot_bridge.firmware.texts import Notice
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mission_plan import MissionStore
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterDefinition, ParameterStore
from autopilot_bridge.services.channel import AddressRule
from autopilot_bridge.services.commands.available_modes import ListedMode
from flightsim.airframe import AirframeKind, LaunchKind

if TYPE_CHECKING:  # its module brings scipy
    from flightsim.flight_envelope import FlightEnvelope


class ModeDisplay(NamedTuple):
    """What HEARTBEAT.base_mode depends on.

    Attributes:
        mode: the mode being flown.
        armed: motors may turn.
        booted: the boot phase is over.
        landed: standing on the ground.
        attitude_setpoints: the setpoint stream commands positions, velocities or attitudes (no body rates).
        thrust_setpoints: the setpoint stream commands attitudes or body rates, with thrust.
    """

    mode: FlightMode
    armed: bool
    booted: bool
    landed: bool
    attitude_setpoints: bool
    thrust_setpoints: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorBits:
    """SYS_STATUS bits of a healthy vehicle; broken sensors are taken out of `health`."""

    present: int
    enabled: int
    enabled_armed: int
    health: int
    health_armed: int


class ControllerFactory(Protocol):
    """Makes the control laws."""

    def __call__(self, parameters: Any, *, physics_rate_hz: int, nav: Array) -> Controller[Any, Any]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """The content of AUTOPILOT_VERSION, PROTOCOL_VERSION and the banner.

    Attributes:
        product: name in texts, "ArduCopter V4.6.3 (3fc7011a)".
        capabilities: MAV_PROTOCOL_CAPABILITY bits.
        flight_sw_version: major, minor, patch and FIRMWARE_VERSION_TYPE, a byte each from the top.
        middleware_sw_version, os_sw_version, board_version, vendor_id, product_id, uid: as AUTOPILOT_VERSION.
        flight_custom_version: 8 bytes of the source revision.
        uid2: 18 bytes of hardware identity.
    """

    product: str
    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int
    os_sw_version: int
    board_version: int
    vendor_id: int
    product_id: int
    uid: int
    flight_custom_version: bytes
    uid2: bytes

    def __post_init__(self) -> None:
        if len(self.flight_custom_version) != 8:
            raise ValueError(f"flight_custom_version has {len(self.flight_custom_version)} bytes, not 8")
        if len(self.uid2) != 18:
            raise ValueError(f"uid2 has {len(self.uid2)} bytes, not 18")


@dataclass(frozen=True, slots=True, kw_only=True)
class Flavour:
    """One firmware for one vehicle class.

    Attributes:
        name: as the user types it.
        kind: the vehicle class.
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        custom_modes: HEARTBEAT.custom_mode of every mode of this firmware.
        mode_names: what the firmware calls its modes in texts.
        base_mode: HEARTBEAT.base_mode.
        listed_modes: what AVAILABLE_MODES lists, in its order; empty: the firmware has no such message.
        policy: what the commander follows.
        notices: the texts of an event; empty for events this firmware is silent about.
        banner: texts that follow a parameter list request.
        identity: versions and capabilities.
        command_address: target ids of commands this firmware takes for its own, for a system id.
        parameter_definitions: the parameter table in listing order.
        airframe: parameter values of the vehicle class that differ from the firmware's defaults, as in an
            airframe file.
        airframe_of: what an aircraft's envelope changes beyond that; None: nothing (a multicopter).
        launch_parameters: parameters that fit the ways an aircraft is launched.
        sensor_bits: of SYS_STATUS.
        has_airspeed: a pitot tube belongs to the vehicle and is looked after.
        controller: makes the control laws from `controller_parameters`.
        vehicle_tasks: makes the flight tasks.
        land_detector: makes the land detector.
        commander_parameters, flight_parameters, controller_parameters, navigation_parameters: typed
            parameters from the store's current values; called again after a change. They clamp what a ground
            station may have set beyond reason, and never raise. Those of an aircraft's flight and controller
            take its `envelope` too.
        text_needs_heartbeat: no STATUSTEXT on a channel before a heartbeat was received there.
        heartbeat_on_mode_change: an extra heartbeat is sent at once.
        sends_events: events are sent as EVENT messages, and texts repeat them.
        bytewise_parameters: integer parameters travel as bit patterns, not as floats.
        reboot_starts_again: a reboot starts the simulated vehicle again too, at its first place and level
            (ArduPilot's SITL); else only the autopilot boots, as on a vehicle.
        services: what its services do differently.
        gps_source: which receiver the first GPS is, as the parameters were at boot.
    """

    name: str
    kind: AirframeKind
    autopilot: int
    vehicle_type: int
    custom_modes: Mapping[FlightMode, int]
    mode_names: Mapping[FlightMode, str]
    base_mode: Callable[[ModeDisplay], int]
    policy: CommanderPolicy
    notices: Callable[[Event], tuple[Notice, ...]]
    banner: tuple[Notice, ...]
    identity: Identity
    command_address: Callable[[int], AddressRule]
    parameter_definitions: Callable[[], tuple[ParameterDefinition, ...]]
    airframe: Mapping[str, float]
    airframe_of: "Callable[[FlightEnvelope], Mapping[str, float]] | None"
    launch_parameters: Mapping[LaunchKind, Mapping[str, float]]
    sensor_bits: SensorBits
    has_airspeed: bool
    controller: ControllerFactory
    vehicle_tasks: Callable[[FlightContext, MissionStore, CommanderPolicy], VehicleTasks]
    land_detector: Callable[[], LandDetector]
    commander_parameters: Callable[[ParameterStore], CommanderParameters]
    flight_parameters: Callable[..., Any]
    controller_parameters: Callable[..., Any]
    navigation_parameters: Callable[[ParameterStore], NavigationParameters]
    text_needs_heartbeat: bool
    heartbeat_on_mode_change: bool
    sends_events: bool
    bytewise_parameters: bool
    services: FirmwareServices
    listed_modes: tuple[ListedMode, ...] = ()
    reboot_starts_again: bool = False
    gps_source: Callable[[ParameterStore], GpsSource] = own_receiver
