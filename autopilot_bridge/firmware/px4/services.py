"""The services of PX4 v1.16.1: what they accept, answer and send, for a multicopter and for a fixed wing."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.data import commands, load_data, message_ids
from autopilot_bridge.firmware.px4 import messages
from autopilot_bridge.firmware.px4.calibration import Px4Calibration
from autopilot_bridge.firmware.px4.commands import Px4Commands, Px4PlaneCommands
from autopilot_bridge.firmware.px4.component_metadata import MOUNT, ComponentMetadataService
from autopilot_bridge.firmware.px4.copter import modes as copter_modes
from autopilot_bridge.firmware.px4.event_service import EventService
from autopilot_bridge.firmware.px4.mission_rules import PX4_MISSION_POLICY, PX4_PLANE_MISSION_POLICY
from autopilot_bridge.firmware.px4.plane import messages as plane_messages
from autopilot_bridge.firmware.px4.plane import modes as plane_modes
from autopilot_bridge.firmware.px4.setpoints import Px4Setpoints
from autopilot_bridge.firmware.px4.texts import copter_notices, plane_notices
from autopilot_bridge.firmware.services import PAYLOAD_RATES_HZ, PAYLOAD_ROLE, FirmwareServices
from autopilot_bridge.firmware.texts import Notice
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, GROUND_STATION_COMPONENT
from autopilot_bridge.navigation.external import ExternalFrame
from autopilot_bridge.parameter_files import QGC_SUFFIX
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import AddressRule
from autopilot_bridge.services.commands.available_modes import AvailableModes, ListedMode
from autopilot_bridge.services.commands.message_interval import IntervalPolicy
from autopilot_bridge.services.commands.power import PowerPolicy
from autopilot_bridge.services.equipment.actuators import Px4Actuators
from autopilot_bridge.services.equipment.payload_commands import PayloadCommands, PayloadPolicy
from autopilot_bridge.services.files.card_layout import CardLayout, LogTimes
from autopilot_bridge.services.files.vehicle_files import vehicle_files
from autopilot_bridge.services.inputs.external_odometry import (
    POSE_FRAMES,
    VELOCITY_FRAMES,
    ExternalOdometryService,
    ExternalPolicy,
)
from autopilot_bridge.services.inputs.follow import FollowService
from autopilot_bridge.services.inputs.landing_target import LandingTargetService
from autopilot_bridge.services.inputs.manual import ManualRules, ManualService
from autopilot_bridge.services.inputs.obstacles import ObstacleService
from autopilot_bridge.services.inputs.timesync import TimeSyncService
from autopilot_bridge.services.inputs.traffic import TrafficRules, TrafficService
from autopilot_bridge.services.inputs.transmitter import GestureRules, ModeSwitchRules
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.protocol import ParameterPolicy
from autopilot_bridge.services.parameters.storage import (
    LOAD,
    RESET,
    RESET_ALL,
    RESET_SENSORS,
    SAVE,
    StoragePolicy,
)
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.equipment import MissionEquipment
from autopilot_bridge.services.vehicle_memory import LOG_ROLE, PowerAction
from autopilot_bridge.telemetry.line import MICROSECONDS, FlowControl

_NO_RADIO_S: Final = 1.0  # the radio counts as lost after this time

PARAMETER_POLICY: Final = ParameterPolicy(
    bytewise=True,
    strict_type=True,
    ignore_case=False,
    index_by_name=True,
    set_echo_to_all=False,
    hash_parameter=True,
    identity=("MAV_SYS_ID", "MAV_COMP_ID"),
    list_per_tick=20,  # measured: 904 in 0.9 s
)
FLOW_CONTROL: Final = FlowControl(
    factors=((25, 0.8), (35, 0.975)), recovery=(50, 1.025), timeout_us=5 * MICROSECONDS
)
"""PX4's `Mavlink::update_radio_status`."""
STORAGE: Final = StoragePolicy(
    actions=frozenset({LOAD, SAVE, RESET, RESET_SENSORS, RESET_ALL}),
    unknown=None,
    armed=Result.TEMPORARILY_REJECTED,
    reset_at_boot=False,
)
POWER: Final = PowerPolicy(
    actions=MappingProxyType({1: PowerAction.REBOOT, 2: PowerAction.SHUTDOWN, 3: PowerAction.REBOOT}),
    nothing=Result.ACCEPTED,
    unknown=Result.DENIED,
    armed=Result.DENIED,
    force=None,
    delay_s=0.4,
)
_MESSAGES: Final = load_data("px4", "messages.toml")
_ITEMS: Final = load_data("px4", "mission_items.toml")
ODOMETRY: Final = ExternalPolicy(
    messages=frozenset(message_ids(_MESSAGES["odometry"])),
    pose_frames=frozenset(POSE_FRAMES),
    velocity_frames=frozenset(VELOCITY_FRAMES),
    enabled=lambda store: True,
    local_frame=lambda store: ExternalFrame.NED,
    one_frame=False,
)
PAYLOAD: Final = PayloadPolicy(
    camera=commands(_ITEMS["camera"]),
    absent=None,
    nose_modes={FlightMode.MISSION: False},  # mission_base.cpp: heading_sp_update
    kinds_of_roi=True,
    bad_place=Result.DENIED,
)
_SWITCH_MODES: Final = load_data("px4.copter", "modes.toml")["switch"]
MANUAL: Final = ManualRules(
    at_rest=(),
    axes=("RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_THROTTLE", "RC_MAP_YAW"),
    gcs_only="",
    source="COM_RC_IN_MODE",
    timeout_s=lambda parameters: _NO_RADIO_S,
    sticks_are_radio=False,
    mode_switch=ModeSwitchRules(
        channel="RC_MAP_FLTMODE",
        slot="COM_FLTMODE{}",
        limits_us=(1167, 1333, 1500, 1667, 1833),
        modes={int(number): FlightMode[mode] for number, mode in _SWITCH_MODES.items()},
    ),
    gesture=GestureRules(
        switch="MAN_ARM_GESTURE",
        arm_from=1,
        disarm_from=1,
        hold_s=lambda parameters: parameters.get("COM_RC_ARM_HYST") * 1e-3,
        throttle_below=-0.8,
        yaw_beyond=0.9,
        centred=True,
        by_hand_only=True,
    ),
)


def _log_times(parameters: ParameterStore) -> LogTimes | None:
    """SDLOG_MODE: -1 never, 0 armed, 1 boot until disarming, 2 always, 3 by a switch (there is none: as 0), 4
    first arming until the end."""
    mode = int(parameters.get("SDLOG_MODE"))
    if mode < 0:
        return None
    return LogTimes(from_boot=mode in (1, 2), after_disarming=mode in (2, 4))


CARD: Final = CardLayout(
    mount=("fs", "microsd"),
    logs=("log",),
    log_folder_by_day=True,
    first_log_id=0,
    parameters=(f"parameters{QGC_SUFFIX}",),
    plans=("plans",),
    save_after_s=0.3,
    log_times=_log_times,
)


def address_rule(system_id: int) -> AddressRule:
    """Own system id only; component 1, 190 (formerly the mission planner's) or 0."""
    return AddressRule(
        system_id=system_id,
        component_ids=frozenset((AUTOPILOT_COMPONENT, GROUND_STATION_COMPONENT)),
        any_system=False,
    )


def _copter_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    return (
        Px4Setpoints(parts),
        Px4Commands(parts),
        messages.Px4Messages(parts),
        *_common_services(parts, listed_modes=copter_modes.LISTED_MODES, notices=copter_notices),
    )


def _plane_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    return (
        Px4Setpoints(parts),  # the same: the offboard task has the same setters
        Px4PlaneCommands(parts),
        plane_messages.Px4PlaneMessages(parts),
        *_common_services(parts, listed_modes=plane_modes.LISTED_MODES, notices=plane_notices),
    )


def _common_services(
    parts: AutopilotParts,
    *,
    listed_modes: tuple[ListedMode, ...],
    notices: Callable[[Event], tuple[Notice, ...]],
) -> tuple[Microservice, ...]:
    metadata = ComponentMetadataService(parts.parameters.definitions, parts.memory.time_us)
    return (
        TimeSyncService(answers_ping=True),
        MissionEquipment(parts),
        ExternalOdometryService(parts, ODOMETRY),
        FollowService(parts, by_position=False),
        LandingTargetService(parts),
        ObstacleService(parts, lambda store: True),
        ManualService(parts, MANUAL),
        Px4Calibration(parts),
        Px4Actuators(parts),
        TrafficService(parts, TrafficRules(conflicts=True)),
        AvailableModes(listed_modes),
        *vehicle_files(
            parts,
            layout=CARD,
            storage=STORAGE,
            power=POWER,
            folders={MOUNT: metadata.store()},
            more=(metadata, EventService(parts.commander, parts.broadcast, notices)),
        ),
        PayloadCommands(parts, PAYLOAD),
    )


def _rates_hz(onboard: Mapping[int, float], gcs: Mapping[int, float]) -> Mapping[str, Mapping[int, float]]:
    return MappingProxyType(
        {"onboard": onboard, "gcs": gcs, PAYLOAD_ROLE: PAYLOAD_RATES_HZ, LOG_ROLE: onboard}
    )


SERVICES: Final = FirmwareServices(
    address=address_rule,
    parameters=PARAMETER_POLICY,
    missions=PX4_MISSION_POLICY,
    intervals=IntervalPolicy(
        unknown_set=Result.FAILED,
        unknown_get=Result.ACCEPTED,
        unknown_request=Result.DENIED,
        fixed=frozenset({dialect.MAVLINK_MSG_ID_HEARTBEAT}),
        refuse_empty=True,
        refuse_running=frozenset(
            {dialect.MAVLINK_MSG_ID_GPS_RAW_INT, dialect.MAVLink_current_event_sequence_message.id}
        ),
    ),
    card=CARD,
    make=_copter_services,
    rates_hz=_rates_hz(messages.ONBOARD_RATES_HZ, messages.GCS_RATES_HZ),
    stream_rate_parameters=MappingProxyType({}),
    flow_control=FLOW_CONTROL,
    position_pushed_at_arm=False,
)
"""Of a multicopter."""

PLANE_SERVICES: Final = replace(
    SERVICES,
    missions=PX4_PLANE_MISSION_POLICY,
    make=_plane_services,
    rates_hz=_rates_hz(plane_messages.ONBOARD_RATES_HZ, plane_messages.GCS_RATES_HZ),
)
