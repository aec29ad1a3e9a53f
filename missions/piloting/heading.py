"""A heading held by bank."""

import math
from dataclasses import dataclass

from missions.atmosphere import GRAVITY_M_S2


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingController:
    """Turn rate in proportion to the heading's error, and the bank that makes it.

    Attributes:
        gain_per_s: turn rate per error.
        bank_max_rad: of the command.
    """

    gain_per_s: float = 0.6
    bank_max_rad: float = math.radians(40.0)

    def roll_rad(self, *, heading_rad: float, wanted_rad: float, airspeed_m_s: float) -> float:
        """Bank angle for a heading, the short way round."""
        error = math.remainder(wanted_rad - heading_rad, math.tau)
        bank = math.atan(self.gain_per_s * error * max(3.0, airspeed_m_s) / GRAVITY_M_S2)
        return max(-self.bank_max_rad, min(self.bank_max_rad, bank))


def heading_deg(heading_rad: float) -> float:
    """A heading as commands carry it: 0 up to, and without, 360 degrees, in single precision too."""
    return round(math.degrees(heading_rad), 3) % 360.0
