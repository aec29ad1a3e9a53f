"""Parameters of the coverage of a flight."""

import math
from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import Options, option

__all__ = ["CoverageParameters", "LateralRange", "Looks"]


class Looks(StrEnum):
    """Which looks of a camera count as independent."""

    PASS = "pass"
    """The best look of each pass: what hides a target from one look hides it from the next ones, too."""
    EACH = "each"
    """Each look: glimpses in Koopman's sense."""


class LateralRange(StrEnum):
    """The probability of detection by the distance at which a straight track passes a target."""

    DEFINITE = "definite"
    """1 within half the sweep width, 0 beyond it."""
    INVERSE_CUBE = "inverse-cube"
    """1 - exp(-W^2 / (4 pi x^2)): Koopman's law of an observer in an aircraft."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CoverageParameters(Options):
    """How a search is assessed. The ground is level, at the height of home plus `ground_m`."""

    cell_m: float | None = option(None, above=0.0, varies="1/200 of the longer side", help="Side of a cell.")
    ground_m: float = option(0.0, help="Height of the searched ground above home.")
    least_height_m: float = option(5.0, least=0.0, help="Height above the ground below which nothing counts.")
    look_s: float = option(0.5, above=0.0, help="Time between two looks of the camera.")
    looks: Looks = option(Looks.PASS, help="Looks that count as independent: the best of a pass, or each.")
    pass_gap_s: float = option(
        10.0, least=0.0, help="Time out of view after which the camera passes a place anew."
    )
    target_size_m: float = option(0.5, above=0.0, help="Side of the target as the camera sees it.")
    detect_peak: float = option(
        0.9, above=0.0, most=1.0, help="Probability of detection of a target that is seen large."
    )
    detect_half_px: float = option(
        8.0, help="Side of the target in the picture with half of that probability (Johnson: 4 line pairs)."
    )
    detect_width_px: float = option(
        2.0, above=0.0, help="Width of the rise of that probability over the side in the picture."
    )
    place_sigma_m: float = option(0.0, least=0.0, help="Standard deviation of the vehicle's place, per axis.")
    attitude_sigma_rad: float = option(
        0.0, least=0.0, help="Standard deviation of the camera's attitude, per axis."
    )
    sweep_width_m: float | None = option(
        None, above=0.0, help="Sweep width of the sensor, in place of a camera."
    )
    lateral_range: LateralRange = option(
        LateralRange.DEFINITE, help="Law of detection of a sensor with a sweep width."
    )
    most_range_m: float | None = option(
        None, above=0.0, varies="2 sweep widths; camera: 2 km", help="Distance beyond which nothing is seen."
    )

    @property
    def reach_m(self) -> float:
        """Distance on the ground beyond which nothing is detected."""
        if self.most_range_m is not None:
            return self.most_range_m
        return 2000.0 if self.sweep_width_m is None else 2.0 * self.sweep_width_m

    @property
    def inverse_cube_m(self) -> float:
        """k h / v of the law of the inverse cube, m^2: W = 2 sqrt(2 pi k h / v)."""
        return (self.sweep_width_m or 0.0) ** 2 / (8.0 * math.pi)
