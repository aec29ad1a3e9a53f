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
from flightsim.foundation.geodesy import FrameAt

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
    """What the vehicle says that it is, in HEARTBEAT, SYS_STATUS, AUTOPILOT_VERSION and its banner.

    Attributes:
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        sensor_bits: of SYS_STATUS.
        product: name in texts, "ArduCopter V4.6.3 (3fc7011a)".
        capabilities: MAV_PROTOCOL_CAPABILITY bits.
        flight_sw_version: major, minor, patch and FIRMWARE_VERSION_TYPE, a byte each from the top.
        middleware_sw_version, os_sw_version, board_version, vendor_id, product_id, uid: as AUTOPILOT_VERSION.
        flight_custom_version: 8 bytes of the source revision.
        uid2: 18 bytes of hardware identity.
    """

    autopilot: int
    vehicle_type: int
    sensor_bits: SensorBits
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
class Modes:
    """The modes of one firmware.

    Attributes:
        custom: HEARTBEAT.custom_mode of every mode of this firmware.
        names: what the firmware calls its modes in texts.
        base_mode: HEARTBEAT.base_mode.
        listed: what AVAILABLE_MODES lists, in its order; empty: the firmware has no such message.
    """

    custom: Mapping[FlightMode, int]
    names: Mapping[FlightMode, str]
    base_mode: Callable[[ModeDisplay], int]
    listed: tuple[ListedMode, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Texts:
    """The texts of one firmware.

    Attributes:
        notices: the texts of an event; empty for events this firmware is silent about.
        banner: texts that follow a parameter list request.
        need_heartbeat: no STATUSTEXT on a channel before a heartbeat was received there.
        repeated_by_events: events are sent as EVENT messages, and texts repeat them.
    """

    notices: Callable[[Event], tuple[Notice, ...]]
    banner: tuple[Notice, ...]
    need_heartbeat: bool
    repeated_by_events: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightParts:
    """What flies a class of vehicle, the same for both firmwares.

    Attributes:
        controller: makes the control laws from `Flavour.controller_parameters`.
        vehicle_tasks: makes the flight tasks.
        land_detector: makes the land detector.
        has_airspeed: a pitot tube belongs to the vehicle and is looked after.
    """

    controller: ControllerFactory
    vehicle_tasks: Callable[[FlightContext, MissionStore, CommanderPolicy], VehicleTasks]
    land_detector: Callable[[], LandDetector]
    has_airspeed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Flavour:
    """One firmware for one vehicle class.

    Attributes:
        name: as the user types it.
        kind: the vehicle class.
        identity: what the vehicle says that it is.
        modes: the firmware's modes, and how it shows them.
        texts: what it says to the pilot.
        flight: control laws and flight tasks of the vehicle class.
        policy: what the commander follows.
        command_address: target ids of commands this firmware takes for its own, for a system id.
        parameter_definitions: the parameter table in listing order.
        airframe: parameter values of the vehicle class that differ from the firmware's defaults, as in an
            airframe file.
        airframe_of: what an aircraft's envelope changes beyond that; None: nothing (a multicopter).
        launch_parameters: parameters that fit the ways an aircraft is launched.
        commander_parameters, flight_parameters, controller_parameters, navigation_parameters: typed
            parameters from the store's current values; called again after a change. They clamp what a ground
            station may have set beyond reason, and never raise. Those of an aircraft's flight and controller
            take its `envelope` too.
        heartbeat_on_mode_change: an extra heartbeat is sent at once.
        reboot_starts_again: a reboot starts the simulated vehicle again too, at its first place and level
            (ArduPilot's SITL); else only the autopilot boots, as on a vehicle.
        frame_at: the kind of its local frame.
        services: what its services do differently.
        gps_source: which receiver the first GPS is, as the parameters were at boot.
    """

    name: str
    kind: AirframeKind
    identity: Identity
    modes: Modes
    texts: Texts
    flight: FlightParts
    policy: CommanderPolicy
    command_address: Callable[[int], AddressRule]
    parameter_definitions: Callable[[], tuple[ParameterDefinition, ...]]
    airframe: Mapping[str, float]
    airframe_of: "Callable[[FlightEnvelope], Mapping[str, float]] | None"
    launch_parameters: Mapping[LaunchKind, Mapping[str, float]]
    commander_parameters: Callable[[ParameterStore], CommanderParameters]
    flight_parameters: Callable[..., Any]
    controller_parameters: Callable[..., Any]
    navigation_parameters: Callable[[ParameterStore], NavigationParameters]
    heartbeat_on_mode_change: bool
    frame_at: FrameAt
    services: FirmwareServices
    reboot_starts_again: bool = False
    gps_source: Callable[[ParameterStore], GpsSource] = own_receiver
