"""The target sensor as a MAVLink component: TUNNEL messages with the detections and the end of every scan
(`autopilot_bridge.mavlink.target_scan`, docs/mavlink/target_scan.md).
"""

from autopilot_bridge.mavlink.components import TARGET_SENSOR_COMPONENT
from autopilot_bridge.mavlink.target_scan import scan_messages
from autopilot_bridge.payload.component import Component
from flightsim.payload import TargetScan, TargetSensor


class TargetSensorComponent(Component[TargetSensor]):
    """Sends every scan when it is taken."""

    component_id = TARGET_SENSOR_COMPONENT

    def update(self, reading: TargetScan) -> None:
        """Send a scan that was taken on this step."""
        for message in scan_messages(reading.number, reading.time_us, reading.detections):
            self.send(message)
