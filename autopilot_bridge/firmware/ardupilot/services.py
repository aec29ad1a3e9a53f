"""The services of ArduPilot 4.6.3: what they accept, answer and send, for ArduCopter and for ArduPlane."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.ardupilot import messages, packed_parameters
from autopilot_bridge.firmware.ardupilot.calibration import ArdupilotCalibration, CompassCalibration
from autopilot_bridge.firmware.ardupilot.copter import modes as copter_modes
from autopilot_bridge.firmware.ardupilot.copter.commands import ArduCopterCommands
from autopilot_bridge.firmware.ardupilot.copter.setpoints import ArduCopterSetpoints
from autopilot_bridge.firmware.ardupilot.counter_parameters import Counters
from autopilot_bridge.firmware.ardupilot.fence_and_rally_points import OldPoints
from autopilot_bridge.firmware.ardupilot.gps_input import GpsInputService
from autopilot_bridge.firmware.ardupilot.mission_files import plan_files
from autopilot_bridge.firmware.ardupilot.mission_rules import (
    ARDUPILOT_MISSION_POLICY,
    ARDUPLANE_MISSION_POLICY,
)
from autopilot_bridge.firmware.ardupilot.plane import messages as plane_messages
from autopilot_bridge.firmware.ardupilot.plane import modes as plane_modes
from autopilot_bridge.firmware.ardupilot.plane.commands import ArduPlaneCommands
from autopilot_bridge.firmware.ardupilot.plane.setpoints import ArduPlaneSetpoints
from autopilot_bridge.firmware.data import commands, load_data, message_ids
from autopilot_bridge.firmware.mapping import integer
from autopilot_bridge.firmware.services import PAYLOAD_RATES_HZ, PAYLOAD_ROLE, FirmwareServices
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation.external import ExternalFrame
from autopilot_bridge.parameter_files import MAVPROXY_SUFFIXES
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import AddressRule
from autopilot_bridge.services.commands.message_interval import IntervalPolicy
from autopilot_bridge.services.commands.power import PowerPolicy
from autopilot_bridge.services.equipment.actuators import ArducopterActuators, ArduplaneActuators
from autopilot_bridge.services.equipment.payload_commands import PayloadCommands, PayloadPolicy
from autopilot_bridge.services.files.card_layout import CardLayout, LogTimes
from autopilot_bridge.services.files.vehicle_files import vehicle_files
from autopilot_bridge.services.inputs.external_odometry import ExternalOdometryService, ExternalPolicy
from autopilot_bridge.services.inputs.follow import FollowService
from autopilot_bridge.services.inputs.landing_target import LandingTargetService
from autopilot_bridge.services.inputs.manual import ManualRules, ManualService
from autopilot_bridge.services.inputs.obstacles import ObstacleService
from autopilot_bridge.services.inputs.timesync import TimeSyncService
from autopilot_bridge.services.inputs.traffic import TrafficRules, TrafficService
from autopilot_bridge.services.inputs.transmitter import GestureRules, ModeSwitchRules
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.protocol import ParameterPolicy
from autopilot_bridge.services.parameters.storage import RESET, StoragePolicy
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.equipment import MissionEquipment
from autopilot_bridge.services.plans.geofence import ArdupilotGeofence
from autopilot_bridge.services.vehicle_memory import LOG_ROLE, PowerAction
from autopilot_bridge.storage import FileStore
from autopilot_bridge.storage.generated import GeneratedStore
from autopilot_bridge.telemetry.line import FlowControl

_COPTER_MAX_RATE_HZ: Final = 0.8 * 400.0  # of SCHED_LOOP_RATE
_PLANE_MAX_RATE_HZ: Final = 0.8 * 50.0
_MAV_TYPE_PROXIMITY: Final = 2  # PRX1_TYPE
EXTERNAL_NAV_SOURCE: Final = 6
"""Value ExternalNav of EK3_SRC1_*."""

PARAMETER_POLICY: Final = ParameterPolicy(
    bytewise=False,
    strict_type=False,
    ignore_case=True,
    index_by_name=False,
    set_echo_to_all=True,
    hash_parameter=False,
    identity=("SYSID_THISMAV",),
    list_per_tick=43,  # measured: 1397 in 0.65 s
)
FLOW_CONTROL: Final = FlowControl(slowdowns_ms=((20, 60), (50, 20)), speedups_ms=((95, 40, 200), (90, 20, 0)))
"""ArduPilot's `GCS_MAVLINK::handle_radio_status`."""
STORAGE: Final = StoragePolicy(
    actions=frozenset({RESET}), unknown=Result.DENIED, armed=Result.DENIED, reset_at_boot=True
)
POWER: Final = PowerPolicy(
    actions=MappingProxyType({1: PowerAction.REBOOT, 3: PowerAction.REBOOT}),
    nothing=Result.UNSUPPORTED,
    unknown=Result.UNSUPPORTED,
    armed=Result.FAILED,
    force=20190226,
    delay_s=0.2,
)


def _by_number(custom_modes: Mapping[FlightMode, int]) -> Mapping[int, FlightMode]:
    """The modes that FLTMODEn selects; of modes with the same number, the last."""
    return {number: mode for mode, number in custom_modes.items()}


def _local_frame(store: ParameterStore) -> ExternalFrame:
    """ArduPilot takes every frame as NED; if it uses the sender's heading, that is a separate frame."""
    yaw_source = integer(store, "EK3_SRC1_YAW", 1)
    return ExternalFrame.LOCAL_FRD if yaw_source == EXTERNAL_NAV_SOURCE else ExternalFrame.NED


_MESSAGES: Final = load_data("ardupilot", "messages.toml")
_ITEMS: Final = load_data("ardupilot", "mission_items.toml")
ODOMETRY: Final = ExternalPolicy(
    messages=frozenset(message_ids(_MESSAGES["odometry"])),
    pose_frames=frozenset({dialect.MAV_FRAME_LOCAL_FRD}),
    velocity_frames=frozenset({dialect.MAV_FRAME_BODY_FRD}),
    enabled=lambda store: integer(store, "VISO_TYPE", 0) != 0,
    local_frame=_local_frame,
    one_frame=True,
)
PAYLOAD: Final = PayloadPolicy(
    camera=commands(_ITEMS["camera"]),
    absent=Result.UNSUPPORTED,
    nose_modes={FlightMode.MISSION: False, FlightMode.GUIDED: True},  # autoyaw.cpp: set_roi
    kinds_of_roi=False,
    bad_place=Result.FAILED,
)
COPTER_MANUAL: Final = ManualRules(
    at_rest=(1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800),
    axes=("RCMAP_ROLL", "RCMAP_PITCH", "RCMAP_THROTTLE", "RCMAP_YAW"),
    gcs_only="SYSID_MYGCS",
    source="",
    timeout_s=lambda parameters: parameters.get("RC_OVERRIDE_TIME"),
    sticks_are_radio=True,
    mode_switch=ModeSwitchRules(
        channel="FLTMODE_CH",
        slot="FLTMODE{}",
        limits_us=(1231, 1361, 1491, 1621, 1750),
        modes=_by_number(copter_modes.CUSTOM_MODES),
    ),
    gesture=GestureRules(
        switch="ARMING_RUDDER",
        arm_from=1,
        disarm_from=2,
        hold_s=lambda parameters: 2.0,
        throttle_below=-0.95,
        yaw_beyond=0.89,
        centred=False,
        by_hand_only=False,
    ),
)
PLANE_MANUAL: Final = replace(
    COPTER_MANUAL,
    mode_switch=replace(COPTER_MANUAL.mode_switch, modes=_by_number(plane_modes.CUSTOM_MODES)),
    gesture=replace(COPTER_MANUAL.gesture, hold_s=lambda parameters: 3.0),
)


def _log_times(parameters: ParameterStore) -> LogTimes | None:
    """LOG_BACKEND_TYPE without its file bit: never. LOG_DISARMED: 0 armed, others always; LOG_FILE_DSRMROT: a
    new one at disarming."""
    if not int(parameters.get("LOG_BACKEND_TYPE")) & 1:
        return None
    always = int(parameters.get("LOG_DISARMED")) != 0
    return LogTimes(
        from_boot=always, after_disarming=always, new_at_disarming=bool(parameters.get("LOG_FILE_DSRMROT"))
    )


CARD: Final = CardLayout(
    mount=("APM",),
    logs=("LOGS",),
    log_folder_by_day=False,
    first_log_id=1,
    parameters=(f"parameters{MAVPROXY_SUFFIXES[0]}",),
    plans=("PLANS",),
    save_after_s=0.0,
    log_times=_log_times,
    armed_refusal="Disarm for log download",
)


def address_rule(system_id: int) -> AddressRule:
    """Own system id or 0, any component id."""
    return AddressRule(system_id=system_id, component_ids=None, any_system=True)


def _copter_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    return (
        ArduCopterSetpoints(parts),
        ArduCopterCommands(parts),
        messages.ArdupilotMessages(parts),
        *_common_services(parts, COPTER_MANUAL, ArducopterActuators(parts)),
    )


def _plane_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    return (
        ArduPlaneSetpoints(parts),
        ArduPlaneCommands(parts),
        plane_messages.ArduPlaneMessages(parts),
        *_common_services(parts, PLANE_MANUAL, ArduplaneActuators(parts)),
    )


def _common_services(
    parts: AutopilotParts, manual: ManualRules, actuators: Microservice
) -> tuple[Microservice, ...]:
    return (
        TimeSyncService(answers_ping=False),
        MissionEquipment(parts),
        ArdupilotGeofence(parts.commander, parts.parameters, parts.broadcast),
        OldPoints(parts.parameters, parts.stores, parts.announce),
        ExternalOdometryService(parts, ODOMETRY),
        GpsInputService(parts),
        FollowService(parts, by_position=True),
        LandingTargetService(parts),
        ObstacleService(parts, lambda store: integer(store, "PRX1_TYPE", 0) == _MAV_TYPE_PROXIMITY),
        ManualService(parts, manual),
        ArdupilotCalibration(parts),
        CompassCalibration(parts),
        actuators,
        TrafficService(parts, TrafficRules(switch="ADSB_TYPE")),
        *vehicle_files(
            parts,
            layout=CARD,
            storage=STORAGE,
            power=POWER,
            folders={
                ("@PARAM",): _packed_parameters(parts.parameters),
                ("@MISSION",): plan_files(parts.stores),
            },
            more=(Counters(parts),),
        ),
        PayloadCommands(parts, PAYLOAD),
    )


def _packed_parameters(store: ParameterStore) -> FileStore:
    """ArduPilot's `@PARAM`."""
    return GeneratedStore(
        {"param.pck": lambda query: packed_parameters.pack(store, query)},
        {"param.pck": lambda data: packed_parameters.apply(store, data)},
    )


def _rates_hz(groups: Mapping[int, tuple[int, ...]]) -> Mapping[str, Mapping[int, float]]:
    """The streams by role. An ArduPilot streams nothing to clients without a request; its log has all."""
    log_hz = {message_id: 10.0 for group in groups.values() for message_id in group}
    fast = (dialect.MAVLINK_MSG_ID_ATTITUDE, dialect.MAVLINK_MSG_ID_RAW_IMU)
    return MappingProxyType(
        {
            "onboard": messages.START_RATES_HZ,
            "gcs": messages.START_RATES_HZ,
            PAYLOAD_ROLE: PAYLOAD_RATES_HZ,
            LOG_ROLE: MappingProxyType(
                {dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0, **log_hz, **dict.fromkeys(fast, 25.0)}
            ),
        }
    )


SERVICES: Final = FirmwareServices(
    address=address_rule,
    parameters=PARAMETER_POLICY,
    missions=ARDUPILOT_MISSION_POLICY,
    intervals=IntervalPolicy(
        unknown_set=Result.DENIED,
        unknown_get=Result.FAILED,
        unknown_request=Result.FAILED,
        not_requestable=messages.NOT_REQUESTABLE,
        max_rate_hz=_COPTER_MAX_RATE_HZ,
        groups=messages.STREAM_GROUPS,
        unknown_text="No ap_message for mavlink id ({})",
        too_fast_text="Requested rate for message ID {} too fast. Increase SCHED_LOOP_RATE",
    ),
    card=CARD,
    make=_copter_services,
    rates_hz=_rates_hz(messages.STREAM_GROUPS),
    stream_rate_parameters=messages.STREAM_RATE_PARAMETERS,
    flow_control=FLOW_CONTROL,
    position_pushed_at_arm=True,
)
"""Of ArduCopter."""

PLANE_SERVICES: Final = replace(
    SERVICES,
    missions=ARDUPLANE_MISSION_POLICY,
    intervals=replace(
        SERVICES.intervals, max_rate_hz=_PLANE_MAX_RATE_HZ, groups=plane_messages.STREAM_GROUPS
    ),
    make=_plane_services,
    rates_hz=_rates_hz(plane_messages.STREAM_GROUPS),
)
