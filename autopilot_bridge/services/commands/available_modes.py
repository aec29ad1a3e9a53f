"""AVAILABLE_MODES: the modes of the vehicle and their names (standard modes protocol; PX4)."""

from collections.abc import Callable, Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.services.channel import Channel
from autopilot_bridge.services.microservice import Microservice


class AvailableModes(Microservice):
    """Answers requests for AVAILABLE_MODES.

    Args:
        flavour: the firmware with these modes.
    """

    def __init__(self, flavour: Flavour) -> None:
        self._modes = flavour.listed_modes

    @property
    def on_demand(self) -> Mapping[int, Callable[[Channel, float], None]]:
        return {mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES: self._send}

    def _send(self, channel: Channel, index: float) -> None:
        """Send the mode with this index (from 1), or all modes for 0."""
        for number, mode in enumerate(self._modes, start=1):
            if index in (0, number):
                channel.send(
                    mavlink.MAVLink_available_modes_message(
                        len(self._modes),
                        number,
                        mode.standard_mode,
                        mode.custom_mode,
                        mode.properties,
                        mode.name.encode(),
                    )
                )
