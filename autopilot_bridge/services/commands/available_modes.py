"""AVAILABLE_MODES: the modes of the vehicle and their names (standard modes protocol; PX4)."""

from collections.abc import Sequence
from typing import NamedTuple

from autopilot_bridge.dispatch import on_request
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Channel
from autopilot_bridge.services.microservice import Microservice


class ListedMode(NamedTuple):
    """A mode as AVAILABLE_MODES lists it (standard modes protocol).

    Attributes:
        custom_mode: as in HEARTBEAT.
        name: empty where `standard_mode` names it.
        standard_mode: MAV_STANDARD_MODE; 0: the mode is the firmware's own.
        properties: MAV_MODE_PROPERTY bits.
    """

    custom_mode: int
    name: str
    standard_mode: int
    properties: int


class AvailableModes(Microservice):
    """Answers requests for AVAILABLE_MODES.

    Args:
        modes: the listed modes, in their order.
    """

    def __init__(self, modes: Sequence[ListedMode]) -> None:
        self._modes = modes

    @on_request(dialect.MAVLink_available_modes_message)
    def _send(self, channel: Channel, index: float) -> None:
        """Send the mode with this index (from 1), or all modes for 0."""
        for number, mode in enumerate(self._modes, start=1):
            if index in (0, number):
                channel.send(
                    dialect.MAVLink_available_modes_message(
                        len(self._modes),
                        number,
                        mode.standard_mode,
                        mode.custom_mode,
                        mode.properties,
                        mode.name.encode(),
                    )
                )
