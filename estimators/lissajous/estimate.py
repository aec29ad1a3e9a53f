"""The Lissajous estimator's estimate of a vehicle."""

from dataclasses import dataclass, field
from typing import ClassVar

from estimators.lissajous.model import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class LissajousEstimate:
    """Position and velocity of a vehicle on a Lissajous pattern.

    Attributes:
        time_us: vehicle time of the newest position used.
        subject: the vehicle's system id.
        north_m, east_m: position from the pattern's centre.
        north_m_s, east_m_s: velocity over ground.
        course_rad, course_variance_rad2: direction of travel clockwise from north (equations 28, 29); the
            variance is infinite at rest.
        omega_x_rad_s, omega_y_rad_s: frequencies along the pattern's axes: nominal, or corrected.
        omega_x_sigma_rad_s, omega_y_sigma_rad_s: their standard deviations.
        covariance: (4, 4) covariance of (north, its rate, east, its rate).
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        "north_m",
        "north_m_s",
        "east_m",
        "east_m_s",
        "course_rad",
        "course_variance_rad2",
        "north_sigma_m",
        "north_sigma_m_s",
        "east_sigma_m",
        "east_sigma_m_s",
        "omega_x_rad_s",
        "omega_y_rad_s",
        "omega_x_sigma_rad_s",
        "omega_y_sigma_rad_s",
    )

    time_us: int
    subject: int
    north_m: float
    north_m_s: float
    east_m: float
    east_m_s: float
    course_rad: float
    course_variance_rad2: float
    omega_x_rad_s: float
    omega_y_rad_s: float
    omega_x_sigma_rad_s: float
    omega_y_sigma_rad_s: float
    covariance: Array = field(compare=False, repr=False)

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        sigmas = [max(0.0, float(self.covariance[i, i])) ** 0.5 for i in range(4)]
        return (
            self.north_m,
            self.north_m_s,
            self.east_m,
            self.east_m_s,
            self.course_rad,
            self.course_variance_rad2,
            *sigmas,
            self.omega_x_rad_s,
            self.omega_y_rad_s,
            self.omega_x_sigma_rad_s,
            self.omega_y_sigma_rad_s,
        )
