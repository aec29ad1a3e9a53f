"""What a survey magnetometer sends, and what its readings can be."""

from typing import Final

__all__ = ["STRONGEST_NT", "STUCK_READINGS", "TOTAL_FIELD_NAME"]

TOTAL_FIELD_NAME: Final = "MAG_NT"
"""Name of the total field, nT, in NAMED_VALUE_FLOAT."""
STRONGEST_NT: Final = 200_000.0
"""A larger reading is saturated: it is three times the Earth's field at its poles."""
STUCK_READINGS: Final = 30
"""After so many equal readings in a row the sensor is stuck: noise makes no two of them equal for so long."""
