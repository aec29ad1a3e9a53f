"""The target sensor as a MAVLink component: TUNNEL messages with the detections and the end of every scan
(`autopilot_bridge.mavlink.target_scan`, docs/mavlink/target_scan.md).
"""

from collections.abc import Callable

from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.mavlink.components import TARGET_SENSOR_COMPONENT
from autopilot_bridge.mavlink.target_scan import scan_messages
from autopilot_bridge.payload.component import Component
from flightsim.payload import TargetScan


class TargetSensorComponent(Component):
    """Sends every scan when it is taken."""

    commands_only = True

    def __init__(self, *, system_id: int, send: Callable[[bytes], None]) -> None:
        super().__init__(
            system_id=system_id,
            component_id=TARGET_SENSOR_COMPONENT,
            mav_type=mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
            send=send,
            rates_hz={},
        )

    def update(self, scan: TargetScan) -> None:
        """Send a scan that was taken on this step."""
        for message in scan_messages(scan.number, scan.time_us, scan.detections):
            self.send(message)
