"""The differences between the firmwares in the mission protocol: the shape of their data."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.plans.rules import ItemRules

CRITICAL: Final = dialect.MAV_SEVERITY_CRITICAL
WARNING: Final = dialect.MAV_SEVERITY_WARNING
INFO: Final = dialect.MAV_SEVERITY_INFO

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


class FeasibilityCheck(Protocol):
    """Why a stored mission may not be flown, in the firmware's words; empty when it may."""

    def __call__(
        self,
        items: tuple[MissionItem, ...],
        parameters: ParameterStore,
        *,
        home_alt_m: float | None,
        landed: bool,
        outside: Callable[[MissionItem], bool] | None,
    ) -> tuple[str, ...]:
        """Check a mission.

        Args:
            items: the stored mission.
            parameters: the vehicle's.
            home_alt_m: home altitude above mean sea level; None: not known.
            landed: the vehicle stands on the ground.
            outside: returns whether an item lies outside the geofence; None: there is none.
        """
        ...


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
        feasibility: checks a stored mission before it is flown; None: only in flight (ArduPilot).
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
    feasibility: FeasibilityCheck | None = None
