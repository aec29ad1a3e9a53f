"""The difference of pressure altitude and height in a climb, outside the standard atmosphere.

On a day warmer or colder than the standard one, a metre of pressure altitude is some per cent more or less of
height (15 K: five per cent). The error is the same on the way up and down, so it is computed from the height
differences between turning points; differences within a band are turbulence and are ignored.
"""

import math
from typing import Final

_BAND_M: Final = 4.0
_COHERENCE_M: Final = 30.0  # height difference over which the error is assumed to add up evenly


class PressureScale:
    """Turns pressure altitudes into growth of the barometer offset's variance."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self._reference_m = math.nan

    def variance_m2(self, altitude_m: float, scale_error: float) -> float:
        """What to add for the newest pressure altitude; `scale_error` is the 1-sigma of the scale."""
        reference = self._reference_m
        if math.isnan(reference):
            self._reference_m = altitude_m
            return 0.0
        nearest = min(altitude_m + _BAND_M, max(altitude_m - _BAND_M, reference))
        self._reference_m = nearest
        return scale_error * scale_error * _COHERENCE_M * abs(nearest - reference)
