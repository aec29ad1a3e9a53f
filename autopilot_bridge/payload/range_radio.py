"""The range radio as a MAVLink component: TUNNEL messages with the ranges to other vehicles
(`autopilot_bridge.mavlink.vehicle_range`, docs/mavlink/vehicle_range.md).
"""

from collections.abc import Sequence

from autopilot_bridge.mavlink.components import RANGE_RADIO_COMPONENT
from autopilot_bridge.mavlink.vehicle_range import VehicleRange, range_message
from autopilot_bridge.payload.component import Component
from flightsim.payload import MeasuredRange, RangeRadio


class RangeRadioComponent(Component[RangeRadio]):
    """Sends every range when it is measured."""

    component_id = RANGE_RADIO_COMPONENT

    def update(self, reading: Sequence[MeasuredRange]) -> None:
        """Send the ranges that were measured on this step."""
        for measured in reading:
            self.send(
                range_message(
                    VehicleRange(
                        to_system=measured.to_system,
                        number=measured.number,
                        time_us=measured.time_us,
                        range_m=measured.range_m,
                        sigma_m=self.device.parameters.sigma_m,
                    )
                )
            )
