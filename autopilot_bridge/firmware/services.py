"""The shape of what the services of one firmware do differently, as data and functions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import AddressRule
from autopilot_bridge.services.commands.message_interval import IntervalPolicy
from autopilot_bridge.services.files.card_layout import CardLayout
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.protocol import ParameterPolicy
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.policy import MissionPolicy
from autopilot_bridge.telemetry.line import FlowControl

PAYLOAD_ROLE: Final = "payload"
PAYLOAD_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {
        dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
        dialect.MAVLINK_MSG_ID_ATTITUDE: 10.0,
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    }
)
"""Messages sent to devices on the vehicle's own bus: its identity, position, attitude and time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareServices:
    """Services of one firmware for one class of vehicle.

    Attributes:
        address: the target ids of this autopilot, for everything but commands.
        parameters, missions, intervals: policies of the services.
        card: the files on the memory card.
        make: makes what the firmware executes, receives and sends, in the order in which the services get
            messages and timers.
        rates_hz: streams that run from the start, by role of the channel.
        stream_rate_parameters: endings of the parameters SRn_* that set the rates of a stream group, by group
            (ArduPilot).
        flow_control: how streams follow a radio's transmit buffer.
        position_pushed_at_arm: HOME_POSITION and GPS_GLOBAL_ORIGIN are sent once more at every arming.
    """

    address: Callable[[int], AddressRule]
    parameters: ParameterPolicy
    missions: MissionPolicy
    intervals: IntervalPolicy
    card: CardLayout
    make: Callable[[AutopilotParts], tuple[Microservice, ...]]
    rates_hz: Mapping[str, Mapping[int, float]]
    stream_rate_parameters: Mapping[int, str]
    flow_control: FlowControl
    position_pushed_at_arm: bool
