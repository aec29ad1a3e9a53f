"""What goes into the investigation of an anomaly and what comes out: measurements, places, and the trace."""

from dataclasses import dataclass

__all__ = ["LikelyPlace", "Sample", "TracePoint"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Averaged readings of one vehicle.

    Attributes:
        time_us: vehicle time of the first reading.
        vehicle: number of the vehicle.
        north_m, east_m, height_m: mean place from the map's home.
        course_rad: course of the vehicle over ground.
        residual_nt: mean of reading less map, less level.
        readings: number of readings.
        excess_nt2: variance of the noise of the mean beyond that of stated readings, by the vehicle's track.
    """

    time_us: int
    vehicle: int
    north_m: float
    east_m: float
    height_m: float
    course_rad: float
    residual_nt: float
    readings: int
    excess_nt2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TracePoint:
    """The state after one measurement.

    Attributes:
        time_us: vehicle time.
        number: number of the pass, from 0.
        residual_nt: the measurement.
        confidence: the paper's C_t, per particle and over its greatest value; NaN: at the first measurement
            of an anomaly, and if no class that is sought is Gaussian.
        probability: that the anomaly is one of the targets.
        evidence: logarithm of the greatest evidence of a target, less the greatest evidence of another
            explanation; without the classes' priors.
    """

    time_us: int
    number: int
    residual_nt: float
    confidence: float
    probability: float
    evidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LikelyPlace:
    """A place from the map's home.

    Attributes:
        north_m, east_m: the place.
        share: of the belief near it.
    """

    north_m: float
    east_m: float
    share: float
