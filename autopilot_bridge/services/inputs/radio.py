"""RADIO_STATUS: a telemetry radio reports how full its transmit buffer is."""

from collections.abc import Callable

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import Channel, MavlinkMessage, Source
from autopilot_bridge.telemetry.throttle import StreamThrottle


class RadioService:
    """Reduces the rates of a channel's streams while the transmit buffer of its radio fills up.

    Args:
        throttle: returns the throttle of a channel's streams; None: the channel has none.
    """

    def __init__(self, throttle: Callable[[Channel], StreamThrottle | None]) -> None:
        self._throttle = throttle

    def handle(self, message: MavlinkMessage, source: Source, time_us: int) -> bool:
        """RADIO_STATUS (109), and RADIO (166) of older radios."""
        if message.get_msgId() not in (mavlink.MAVLINK_MSG_ID_RADIO_STATUS, mavlink.MAVLINK_MSG_ID_RADIO):
            return False
        throttle = self._throttle(source.channel)
        if throttle is not None:
            throttle.radio.heard(message.txbuf, time_us)
            throttle.fit()
        return True
