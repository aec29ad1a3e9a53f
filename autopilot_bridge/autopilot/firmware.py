"""The differences between the flavours in the autopilot's messages and services, in one table."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.ardupilot import messages as ardupilot
from autopilot_bridge.firmware.ardupilot.plane import messages as ardupilot_plane
from autopilot_bridge.firmware.px4 import messages as px4
from autopilot_bridge.firmware.px4.plane import messages as px4_plane
from autopilot_bridge.services.channel import AddressRule, ardupilot_address_rule, px4_address_rule
from autopilot_bridge.services.commands.message_interval import IntervalPolicy
from autopilot_bridge.services.parameters.protocol import (
    ARDUPILOT_PARAMETER_POLICY,
    PX4_PARAMETER_POLICY,
    ParameterPolicy,
)
from autopilot_bridge.services.plans.policy import (
    ARDUPILOT_MISSION_POLICY,
    ARDUPLANE_MISSION_POLICY,
    PX4_MISSION_POLICY,
    PX4_PLANE_MISSION_POLICY,
    MissionPolicy,
)
from autopilot_bridge.services.vehicle_memory import LOG_ROLE
from autopilot_bridge.telemetry.line import ARDUPILOT_FLOW_CONTROL, PX4_FLOW_CONTROL, FlowControl
from flightsim.airframe import AirframeKind

_ARDUPILOT_MAX_RATE_HZ: Final = 0.8 * 400.0  # of SCHED_LOOP_RATE
_ARDUPLANE_MAX_RATE_HZ: Final = 0.8 * 50.0

PAYLOAD_ROLE: Final = "payload"
PAYLOAD_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: 10.0,
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    }
)
"""Messages sent to devices on the vehicle's own bus: its identity, position, attitude and time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Firmware:
    """Services of one flavour.

    Attributes:
        address: the target ids of this autopilot, for everything but commands.
        parameters, missions, intervals: policies of the services.
        rates_hz: streams that run from the start, by role of the channel.
        answers_ping: PING requests are answered.
        flow_control: how streams follow a radio's transmit buffer.
        position_pushed_at_arm: HOME_POSITION and GPS_GLOBAL_ORIGIN are sent once more at every arming.
    """

    address: Callable[[int], AddressRule]
    parameters: ParameterPolicy
    missions: MissionPolicy
    intervals: IntervalPolicy
    rates_hz: Mapping[str, Mapping[int, float]]
    answers_ping: bool
    flow_control: FlowControl
    position_pushed_at_arm: bool


def _log_rates_hz(groups: Mapping[int, tuple[int, ...]]) -> Mapping[int, float]:
    """The log streams of an ArduPilot, which streams nothing to clients without a request."""
    rates_hz = {message_id: 10.0 for group in groups.values() for message_id in group}
    fast = (mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_RAW_IMU)
    return MappingProxyType({mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0, **rates_hz, **dict.fromkeys(fast, 25.0)})


_PX4: Final = Firmware(
    address=px4_address_rule,
    parameters=PX4_PARAMETER_POLICY,
    missions=PX4_MISSION_POLICY,
    intervals=IntervalPolicy(
        unknown_set=Result.FAILED,
        unknown_get=Result.ACCEPTED,
        unknown_request=Result.DENIED,
        fixed=frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT}),
        refuse_running=True,
    ),
    rates_hz=MappingProxyType(
        {
            "onboard": px4.ONBOARD_RATES_HZ,
            "gcs": px4.GCS_RATES_HZ,
            PAYLOAD_ROLE: PAYLOAD_RATES_HZ,
            LOG_ROLE: px4.ONBOARD_RATES_HZ,
        }
    ),
    answers_ping=True,
    flow_control=PX4_FLOW_CONTROL,
    position_pushed_at_arm=False,
)
_ARDUPILOT: Final = Firmware(
    address=ardupilot_address_rule,
    parameters=ARDUPILOT_PARAMETER_POLICY,
    missions=ARDUPILOT_MISSION_POLICY,
    intervals=IntervalPolicy(
        unknown_set=Result.DENIED,
        unknown_get=Result.FAILED,
        unknown_request=Result.FAILED,
        not_requestable=ardupilot.NOT_REQUESTABLE,
        max_rate_hz=_ARDUPILOT_MAX_RATE_HZ,
        groups=ardupilot.STREAM_GROUPS,
        unknown_text="No ap_message for mavlink id ({})",
        too_fast_text="Requested rate for message ID {} too fast. Increase SCHED_LOOP_RATE",
    ),
    rates_hz=MappingProxyType(
        {
            "onboard": ardupilot.START_RATES_HZ,
            "gcs": ardupilot.START_RATES_HZ,
            PAYLOAD_ROLE: PAYLOAD_RATES_HZ,
            LOG_ROLE: _log_rates_hz(ardupilot.STREAM_GROUPS),
        }
    ),
    answers_ping=False,
    flow_control=ARDUPILOT_FLOW_CONTROL,
    position_pushed_at_arm=True,
)

FIRMWARES: Final[Mapping[tuple[str, AirframeKind], Firmware]] = MappingProxyType(
    {
        ("px4", AirframeKind.MULTICOPTER): _PX4,
        ("px4", AirframeKind.FIXED_WING): replace(
            _PX4,
            missions=PX4_PLANE_MISSION_POLICY,
            rates_hz=MappingProxyType(
                {
                    **_PX4.rates_hz,
                    "onboard": px4_plane.ONBOARD_RATES_HZ,
                    "gcs": px4_plane.GCS_RATES_HZ,
                    LOG_ROLE: px4_plane.ONBOARD_RATES_HZ,
                }
            ),
        ),
        ("ardupilot", AirframeKind.MULTICOPTER): _ARDUPILOT,
        ("ardupilot", AirframeKind.FIXED_WING): replace(
            _ARDUPILOT,
            missions=ARDUPLANE_MISSION_POLICY,
            intervals=replace(
                _ARDUPILOT.intervals,
                max_rate_hz=_ARDUPLANE_MAX_RATE_HZ,
                groups=ardupilot_plane.STREAM_GROUPS,
            ),
            rates_hz=MappingProxyType(
                {**_ARDUPILOT.rates_hz, LOG_ROLE: _log_rates_hz(ardupilot_plane.STREAM_GROUPS)}
            ),
        ),
    }
)
