"""The survey magnetometer as a MAVLink component: NAMED_VALUE_FLOAT "MAG_NT", total field in nT.

MAVLink has no message for the magnitude of the field; a named value is the standard way for such readings.
In single precision a field of 50,000 nT is reported to 0.004 nT.
"""

from struct import Struct
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.payload.component import Component, fixed_text
from flightsim.payload import MagneticReading, SurveyMagnetometer

TOTAL_FIELD_NAME: Final = "MAG_NT"
_NAME: Final = fixed_text(TOTAL_FIELD_NAME, 10)
_MESSAGE_ID: Final = int(dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT)
_pack: Final = Struct("<If10s").pack


class SurveyMagnetometerComponent(Component[SurveyMagnetometer]):
    """Sends every reading when it comes."""

    component_id = SURVEY_MAGNETOMETER_COMPONENT

    def update(self, reading: MagneticReading) -> None:
        """Send a reading that was delivered on this step."""
        time_ms = (reading.time_us // 1000) & 0xFFFFFFFF
        self.send_payload(_MESSAGE_ID, _pack(time_ms, reading.total_field_nt, _NAME))
