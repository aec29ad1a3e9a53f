"""Heading control by bank."""

import math
from dataclasses import dataclass

from flightsim.foundation.atmosphere import GRAVITY_M_S2


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingController:
    """Commands a turn rate proportional to the heading error, and the bank that gives this rate.

    Attributes:
        gain_per_s: turn rate per heading error.
        bank_max_rad: largest commanded bank.
    """

    gain_per_s: float = 0.6
    bank_max_rad: float = math.radians(40.0)

    def roll_rad(self, *, heading_rad: float, wanted_rad: float, airspeed_m_s: float) -> float:
        """Bank angle for turning to a heading, the short way round."""
        error = math.remainder(wanted_rad - heading_rad, math.tau)
        bank = math.atan(self.gain_per_s * error * max(3.0, airspeed_m_s) / GRAVITY_M_S2)
        return max(-self.bank_max_rad, min(self.bank_max_rad, bank))


def heading_deg(heading_rad: float) -> float:
    """A heading for use in commands, in degrees: at least 0 and less than 360, also in single precision."""
    return round(math.degrees(heading_rad), 3) % 360.0
