"""The differences between PX4 and ArduPilot in the mission protocol, as data."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot.mission_rules import ArdupilotItemRules
from autopilot_bridge.firmware.px4.mission_rules import Px4ItemRules
from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.services.plans.rules import ItemRules

CRITICAL: Final = mavlink.MAV_SEVERITY_CRITICAL
WARNING: Final = mavlink.MAV_SEVERITY_WARNING
INFO: Final = mavlink.MAV_SEVERITY_INFO

Text = tuple[int, str] | None
"""A STATUSTEXT (MAV_SEVERITY, text), or nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionTexts:
    """The STATUSTEXTs of the mission protocol; None where the firmware sends no text."""

    upload_busy: Text = None
    download_open: Text = None
    uploading: Text = None
    clear_busy: Text = None
    set_current_busy: Text = None
    no_transfer: Text = None
    partner_mismatch: Text = None
    unexpected_request: Text = None
    not_in_list: Text = None
    invalid_item: Text = None
    timeout: Text = None
    too_many: Text = None  # with {capacity}
    partial_rejected: Text = None
    changed_in_flight: Text = None
    float_item: Text = None
    float_request: Text = None
    home_outside_fence: Text = None
    received: Mapping[MissionType, str] = field(default_factory=dict)  # MAV_SEVERITY_INFO


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionPolicy:
    """The differences of one firmware.

    Attributes:
        rules: the item types that it accepts and how it stores them.
        texts: its STATUSTEXTs.
        capacity: items per mission type.
        retry_us: a request not answered is repeated after this time.
        timeout_us: an upload (PX4: also a download) not continued ends after this time.
        timeout_result: MISSION_ACK result sent then; None: no MISSION_ACK.
        requests_as_int: requests with MISSION_REQUEST_INT once the client has used it; else MISSION_REQUEST.
        wrong_sequence_result: MISSION_ACK result for an item out of sequence; None: ignored in silence.
        restart_on_count: a new MISSION_COUNT of the client restarts the upload; else "busy" once items came.
        foreign_count_result: MISSION_ACK result for a MISSION_COUNT while another client uploads.
        ordered_download: items are only sent in an open list and in order.
        home_is_item_0: item 0 is the home position, whatever was uploaded.
        partial_writes: MISSION_WRITE_PARTIAL_LIST is supported.
        clears_all_types: MISSION_CLEAR_ALL with type 255, and of unknown types, is accepted.
        refuses_clear_in_flight: MISSION_CLEAR_ALL is refused while the mission is flown.
        plan_ids: plan identifiers are sent.
        total_when_empty: MISSION_CURRENT.total without a mission.
        mission_state: MISSION_CURRENT.mission_state and mission_mode are filled in.
        reached_repeats: how often MISSION_ITEM_REACHED is repeated, once a second.
        sends_current_on_change: MISSION_CURRENT goes out at once when the current item changes.
        acks_set_current: MISSION_SET_CURRENT is answered with MISSION_CURRENT.
        guided_items: MISSION_ITEM with current = 2 is a guided-mode target (old DroneKit clients).
        aircraft: the vehicle is a fixed wing, whose missions must meet additional rules (PX4).
    """

    rules: ItemRules
    texts: MissionTexts
    capacity: Mapping[MissionType, int]
    retry_us: int
    timeout_us: int
    timeout_result: int | None
    requests_as_int: bool
    wrong_sequence_result: int | None
    restart_on_count: bool
    foreign_count_result: int
    ordered_download: bool
    home_is_item_0: bool
    partial_writes: bool
    clears_all_types: bool
    refuses_clear_in_flight: bool
    plan_ids: bool
    total_when_empty: int
    mission_state: bool
    reached_repeats: int
    sends_current_on_change: bool
    acks_set_current: bool
    guided_items: bool
    aircraft: bool = False


PX4_MISSION_POLICY: Final = MissionPolicy(
    rules=Px4ItemRules(),
    texts=MissionTexts(
        upload_busy=(CRITICAL, "WPM: REJ. CMD: Busy"),
        download_open=(CRITICAL, "WPM: IGN MISSION_COUNT: Busy"),
        uploading=(INFO, "Mission download request ignored, already active"),
        clear_busy=(CRITICAL, "WPM: IGN CLEAR CMD: Busy"),
        set_current_busy=(CRITICAL, "WPM: IGN WP CURR CMD: Busy"),
        no_transfer=(CRITICAL, "IGN MISSION_ITEM: No transfer"),
        partner_mismatch=(CRITICAL, "REJ. MIS ITEM: partner id mismatch"),
        unexpected_request=(CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected"),
        not_in_list=(CRITICAL, "WPM: WP CURR CMD: Not in list"),
        invalid_item=(CRITICAL, "IGN MISSION_ITEM: Invalid item"),
        timeout=(CRITICAL, "Operation timeout"),
        home_outside_fence=(CRITICAL, "Geofence invalid, doesn't contain Home position"),
    ),
    capacity={MissionType.MISSION: 10_000, MissionType.FENCE: 64, MissionType.RALLY: 32},
    retry_us=250_000,
    timeout_us=5_000_000,
    timeout_result=None,
    requests_as_int=True,
    wrong_sequence_result=None,
    restart_on_count=False,
    foreign_count_result=mavlink.MAV_MISSION_ERROR,
    ordered_download=True,
    home_is_item_0=False,
    partial_writes=False,
    clears_all_types=True,
    refuses_clear_in_flight=False,
    plan_ids=True,
    total_when_empty=65535,
    mission_state=False,
    reached_repeats=10,
    sends_current_on_change=True,
    acks_set_current=False,
    guided_items=False,
)

ARDUPILOT_MISSION_POLICY: Final = MissionPolicy(
    rules=ArdupilotItemRules(),
    texts=MissionTexts(
        timeout=(WARNING, "Mission upload timeout"),
        too_many=(WARNING, "Only {capacity} items are supported"),
        partial_rejected=(WARNING, "Flight plan update rejected"),
        changed_in_flight=(CRITICAL, "Auto mission changed but failed to restart command"),
        float_item=(WARNING, "got MISSION_ITEM; GCS should send MISSION_ITEM_INT"),
        float_request=(WARNING, "got MISSION_REQUEST; use MISSION_REQUEST_INT!"),
        received={
            MissionType.MISSION: "Flight plan received",
            MissionType.FENCE: "Fence received",
            MissionType.RALLY: "Rally points received",
        },
    ),
    capacity={MissionType.MISSION: 650, MissionType.FENCE: 84, MissionType.RALLY: 50},
    retry_us=1_000_000,
    timeout_us=8_000_000,
    timeout_result=mavlink.MAV_MISSION_OPERATION_CANCELLED,
    requests_as_int=False,
    wrong_sequence_result=mavlink.MAV_MISSION_INVALID_SEQUENCE,
    restart_on_count=True,
    foreign_count_result=mavlink.MAV_MISSION_DENIED,
    ordered_download=False,
    home_is_item_0=True,
    partial_writes=True,
    clears_all_types=False,
    refuses_clear_in_flight=True,
    plan_ids=False,
    total_when_empty=0,
    mission_state=True,
    reached_repeats=0,
    sends_current_on_change=False,
    acks_set_current=True,
    guided_items=True,
)

PX4_PLANE_MISSION_POLICY: Final = replace(PX4_MISSION_POLICY, aircraft=True)

ARDUPLANE_MISSION_POLICY: Final = replace(
    ARDUPILOT_MISSION_POLICY,
    rules=ArdupilotItemRules(aircraft=True),
    capacity={**ARDUPILOT_MISSION_POLICY.capacity, MissionType.MISSION: 655},
)
