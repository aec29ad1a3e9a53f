"""Parameters of the Lissajous estimator: the pattern, its uncertainty, and the measurement."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from flightsim.foundation.options import Options, option


class Form(StrEnum):
    """The three estimators of Steckenrider et al. 2020, Table IV."""

    MEASUREMENT = "measurement"
    """The measurement itself, unfiltered (N)."""
    KALMAN = "kalman"
    """Kalman filter that takes the frequencies as exactly known (K)."""
    PROPOSED = "proposed"
    """Kalman filter that accounts for the uncertainty of the frequencies (P)."""


class Source(StrEnum):
    """The message from which the vehicle's position is taken."""

    GPS = "gps"
    """GPS_RAW_INT: the receiver's own fixes, which are not filtered by the autopilot."""
    GLOBAL = "global"
    """GLOBAL_POSITION_INT: the autopilot's estimate."""
    LOCAL = "local"
    """LOCAL_POSITION_NED: the autopilot's estimate, in its local frame."""


_SIGMAS: Final = {Source.GPS: (0.3, 0.1), Source.GLOBAL: (0.15, 0.08), Source.LOCAL: (0.15, 0.08)}


@dataclass(frozen=True, slots=True, kw_only=True)
class LissajousParameters(Options):
    """Parameters of `LissajousEstimator`; the default frequencies are those of `fly lissajous --pattern L3
    --period 150`.
    """

    form: Form = option(
        Form.PROPOSED, help="Estimator of Table IV: measurement, Kalman filter, or the paper's."
    )
    frequency: bool = option(
        False, help="Frequencies are states that are corrected in flight; with form=proposed."
    )
    source: Source = option(Source.GPS, help="Message with the measurement.")
    omega_x_rad_s: float = option(
        3.0 * math.tau / 150.0, above=0.0, help="Nominal frequency along the pattern's x axis."
    )
    omega_y_rad_s: float = option(
        4.0 * math.tau / 150.0, above=0.0, help="Nominal frequency along the pattern's y axis."
    )
    epsilon_rad_s: float = option(
        1e-4, least=0.0, help="Variance of a frequency over the frequency itself (paper: epsilon)."
    )
    orientation_rad: float = option(
        0.5 * math.pi, help="Direction of the pattern's x axis from north; a quarter turn: east."
    )
    centre_lat_deg: float | None = option(
        None,
        least=-90.0,
        most=90.0,
        varies="the vehicle's home",
        help="Latitude of the reference place of the pattern's centre.",
    )
    centre_lon_deg: float | None = option(
        None,
        least=-180.0,
        most=180.0,
        varies="the vehicle's home",
        help="Longitude of the reference place of the pattern's centre.",
    )
    centre_north_m: float = option(0.0, help="Distance of the pattern's centre north of that place.")
    centre_east_m: float = option(0.0, help="Distance of the pattern's centre east of that place.")
    position_sigma_m: float | None = option(
        None,
        above=0.0,
        varies="gps: 0.3; else 0.15",
        help="Standard deviation of the measured position, per axis.",
    )
    velocity_sigma_m_s: float | None = option(
        None,
        above=0.0,
        varies="gps: 0.1; else 0.08",
        help="Standard deviation of the measured velocity, per axis.",
    )
    position_delay_s: float = option(0.0, help="Age of a measurement at the time that it carries.")
    acceleration_psd_m2_s3: float = option(
        0.02, least=0.0, help="Spectral density of the acceleration that the motion model lacks."
    )
    frequency_walk_rad2_s3: float = option(
        1e-8, least=0.0, help="Increase of a frequency's variance per second, when it is a state."
    )
    off_pattern_gate: float = option(
        50.0, least=0.0, help="Squared Mahalanobis distance that shows a vehicle off the pattern; 0: never."
    )
    max_gap_s: float = option(5.0, above=0.0, help="Longest gap that does not restart the estimator.")
    history_s: float = option(
        2.0, above=0.0, help="Time for which past states are kept, for delayed measurements."
    )

    def check_together(self) -> None:
        if self.frequency and self.form is not Form.PROPOSED:
            raise ValueError(f"frequency with form={self.form}: correcting frequencies needs form=proposed")
        if (self.centre_lat_deg is None) != (self.centre_lon_deg is None):
            raise ValueError("centre_lat_deg and centre_lon_deg go together; give both or neither")

    @property
    def sigmas(self) -> tuple[float, float]:
        """One sigma of position (m) and velocity (m/s), each axis."""
        position_m, velocity_m_s = _SIGMAS[self.source]
        return self.position_sigma_m or position_m, self.velocity_sigma_m_s or velocity_m_s

    @property
    def has_centre(self) -> bool:
        """Whether the pattern's centre is specified by coordinates."""
        return self.centre_lat_deg is not None
