"""The moving-point camera as a MAVLink component: TUNNEL messages with the moving points of every frame
(`autopilot_bridge.mavlink.moving_points`, docs/mavlink/moving_points.md).
"""

from collections.abc import Callable

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.mavlink.components import MOVING_POINT_COMPONENT
from autopilot_bridge.mavlink.moving_points import moving_points_messages
from autopilot_bridge.payload.component import Component
from flightsim.payload import MovingPointScan


class MovingPointComponent(Component):
    """Sends every scan when it is delivered.

    Args:
        sigma: standard deviation of the points, which the camera reports with them.
    """

    def __init__(self, *, system_id: int, send: Callable[[bytes], None], sigma: float) -> None:
        super().__init__(
            system_id=system_id,
            component_id=MOVING_POINT_COMPONENT,
            mav_type=mavlink.MAV_TYPE_CAMERA,
            send=send,
            rates_hz={},
        )
        self._sigma = sigma

    def update(self, scan: MovingPointScan) -> None:
        """Send a scan that was delivered on this step."""
        for message in moving_points_messages(scan.number, scan.time_us, scan.points, self._sigma):
            self.send(message)

    def _on_message(self, message: MAVLinkMessage, sender: tuple[int, int]) -> None:
        """Ignore the message: the camera uses commands only."""
