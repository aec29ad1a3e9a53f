"""RADIO_STATUS: a telemetry radio reports how full its transmit buffer is."""

from collections.abc import Callable

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.services.channel import Channel, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.telemetry.throttle import StreamThrottle


class RadioService(Microservice):
    """Reduces the rates of a channel's streams while the transmit buffer of its radio fills up.

    Args:
        throttle: returns the throttle of a channel's streams; None: the channel has none.
    """

    def __init__(self, throttle: Callable[[Channel], StreamThrottle | None]) -> None:
        self._throttle = throttle

    @receives(mavlink.MAVLINK_MSG_ID_RADIO_STATUS, mavlink.MAVLINK_MSG_ID_RADIO)
    def _on_status(
        self,
        message: mavlink.MAVLink_radio_status_message | mavlink.MAVLink_radio_message,
        source: Source,
        time_us: int,
    ) -> None:
        throttle = self._throttle(source.channel)
        if throttle is not None:
            throttle.radio.on_radio_status(message.txbuf, time_us)
            throttle.fit()
