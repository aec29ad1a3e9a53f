"""Parameters of the Lissajous estimator: the pattern, its uncertainty, and the measurement."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from flightsim.foundation.checks import (
    named,
    require_finite,
    require_members,
    require_not_negative,
    require_positive,
)


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
class LissajousParameters:
    """Parameters of `LissajousEstimator`; the default frequencies are those of `fly lissajous --pattern L3
    --period 150`.

    Attributes:
        form: one of the paper's three estimators.
        frequency: use the frequencies as states and correct them in flight (an extended Kalman filter of six
            states; the paper's future work). Only with `form=proposed`.
        source: the message with the measurement.
        omega_x_rad_s, omega_y_rad_s: nominal frequencies along the pattern's axes.
        epsilon_rad_s: variance of a frequency over the frequency itself (the paper's epsilon), so the
            standard deviation is sqrt(epsilon omega).
        orientation_rad: direction of the pattern's x axis, clockwise from north; its y axis is 90 degrees
            farther clockwise. At a quarter turn x is east, as in `fly lissajous`.
        centre_lat_deg, centre_lon_deg: reference place of the pattern's centre; None: the vehicle's home
            (HOME_POSITION).
        centre_north_m, centre_east_m: the pattern's centre from that place.
        position_sigma_m, velocity_sigma_m_s: one sigma per axis of the measurement; None: depends on the
            source, 0.3 m and 0.1 m/s for gps, 0.15 m and 0.08 m/s for the autopilot's estimates.
        position_delay_s: age of a measurement at the time that it carries.
        acceleration_psd_m2_s3: spectral density of the acceleration that the motion model lacks.
        frequency_walk_rad2_s3: increase of a frequency's variance per second, when it is a state.
        off_pattern_gate: squared Mahalanobis distance (four degrees of freedom) above which a measurement
            shows that the vehicle is not on the pattern (in transit): the filter then restarts from it. 0:
            never.
        max_gap_s: a longer gap restarts the estimator.
        history_s: time for which past states are kept, for delayed measurements.
    """

    form: Form = Form.PROPOSED
    frequency: bool = False
    source: Source = Source.GPS
    omega_x_rad_s: float = 3.0 * math.tau / 150.0
    omega_y_rad_s: float = 4.0 * math.tau / 150.0
    epsilon_rad_s: float = 1e-4
    orientation_rad: float = 0.5 * math.pi
    centre_lat_deg: float | None = None
    centre_lon_deg: float | None = None
    centre_north_m: float = 0.0
    centre_east_m: float = 0.0
    position_sigma_m: float | None = None
    velocity_sigma_m_s: float | None = None
    position_delay_s: float = 0.0
    acceleration_psd_m2_s3: float = 0.02
    frequency_walk_rad2_s3: float = 1e-8
    off_pattern_gate: float = 50.0
    max_gap_s: float = 5.0
    history_s: float = 2.0

    def __post_init__(self) -> None:
        require_members(self, form=Form, source=Source)
        require_positive(
            **named(self, "omega_x_rad_s", "omega_y_rad_s", "max_gap_s", "history_s"),
            **named(self, "position_sigma_m", "velocity_sigma_m_s"),
        )
        require_not_negative(
            **named(self, "epsilon_rad_s", "acceleration_psd_m2_s3", "frequency_walk_rad2_s3"),
            off_pattern_gate=self.off_pattern_gate,
        )
        require_finite(
            **named(self, "orientation_rad", "centre_north_m", "centre_east_m", "position_delay_s")
        )
        if self.frequency and self.form is not Form.PROPOSED:
            raise ValueError(f"frequency with form={self.form}: correcting frequencies needs form=proposed")
        if (self.centre_lat_deg is None) != (self.centre_lon_deg is None):
            raise ValueError("centre_lat_deg and centre_lon_deg go together; give both or neither")
        lat_deg, lon_deg = self.centre_lat_deg or 0.0, self.centre_lon_deg or 0.0
        if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
            raise ValueError(f"centre {lat_deg:g},{lon_deg:g} deg is not in -90..90, -180..180")

    @property
    def sigmas(self) -> tuple[float, float]:
        """One sigma of position (m) and velocity (m/s), each axis."""
        position_m, velocity_m_s = _SIGMAS[self.source]
        return self.position_sigma_m or position_m, self.velocity_sigma_m_s or velocity_m_s

    @property
    def has_centre(self) -> bool:
        """Whether the pattern's centre is specified by coordinates."""
        return self.centre_lat_deg is not None
