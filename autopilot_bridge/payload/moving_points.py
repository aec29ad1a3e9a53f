"""The moving-point camera as a MAVLink component: TUNNEL messages with the moving points of every frame
(`autopilot_bridge.mavlink.moving_points`, docs/mavlink/moving_points.md).
"""

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import MOVING_POINT_COMPONENT
from autopilot_bridge.mavlink.moving_points import moving_points_messages
from autopilot_bridge.payload.component import Component
from flightsim.payload import MovingPointCamera, MovingPointScan


class MovingPointComponent(Component[MovingPointCamera]):
    """Sends every scan when it is delivered, with the standard deviation that the camera states."""

    component_id = MOVING_POINT_COMPONENT
    mav_type = dialect.MAV_TYPE_CAMERA

    def update(self, reading: MovingPointScan) -> None:
        """Send a scan that was delivered on this step."""
        sigma = self.device.parameters.pixel_rad
        for message in moving_points_messages(reading.number, reading.time_us, reading.points, sigma):
            self.send(message)
