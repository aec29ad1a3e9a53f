"""The range radio as a MAVLink component: TUNNEL messages with the ranges to other vehicles
(`autopilot_bridge.mavlink.vehicle_range`, docs/mavlink/vehicle_range.md).
"""

from collections.abc import Callable, Sequence

from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.mavlink.components import RANGE_RADIO_COMPONENT
from autopilot_bridge.mavlink.vehicle_range import VehicleRange, range_message
from autopilot_bridge.payload.component import Component
from flightsim.payload import MeasuredRange


class RangeRadioComponent(Component):
    """Sends every range when it is measured.

    Args:
        sigma_m: standard deviation of the ranges, which the radio reports with them.
    """

    commands_only = True

    def __init__(self, *, system_id: int, send: Callable[[bytes], None], sigma_m: float) -> None:
        super().__init__(
            system_id=system_id,
            component_id=RANGE_RADIO_COMPONENT,
            mav_type=mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
            send=send,
            rates_hz={},
        )
        self._sigma_m = sigma_m

    def update(self, ranges: Sequence[MeasuredRange]) -> None:
        """Send the ranges that were measured on this step."""
        for measured in ranges:
            self.send(
                range_message(
                    VehicleRange(
                        to_system=measured.to_system,
                        number=measured.number,
                        time_us=measured.time_us,
                        range_m=measured.range_m,
                        sigma_m=self._sigma_m,
                    )
                )
            )
