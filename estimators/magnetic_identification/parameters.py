"""Parameters of the identification of magnetic targets."""

from dataclasses import dataclass
from typing import Final

from estimators.magnetic_identification.classes import AnomalyClass, GaussianClass, classes_from
from flightsim.foundation.checks import named, require_not_negative, require_positive

__all__ = ["FALSE_ANOMALIES", "TARGETS", "IdentificationParameters"]

TARGETS: Final = ("target:gaussian:30:80:60",)
"""Default classes that are sought."""
FALSE_ANOMALIES: Final = ("boat:dipole:15:50:150",)
"""Default known classes that are not sought."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationParameters:
    """Parameters of `Identifier`.

    Attributes:
        targets: classes that are sought, as `NAME:gaussian:AMPLITUDE:ALONG:ACROSS` (nT, m, m) or
            `NAME:dipole:STRENGTH:LEAST:MOST` (nT, m, m).
        false_anomalies: known classes that are not sought, likewise.
        target_prior: probability, before any measurement, that an anomaly is one of the targets.
        particles: number of particles of each class.
        roulette: resample by the paper's roulette wheel instead of systematically.
        interval_s: time over which readings are averaged for one measurement (paper: 1 s).
        threshold_nt: an anomaly begins beyond it, or beyond 3 standard deviations of map and noise if that is
            larger (paper: 1 nT).
        noise_nt: standard deviation of one reading.
        map_error_nt: standard deviation of the map; None: as the map states it, else 1 nT.
        shape_error: error of a measurement relative to itself, as no signature is exact; 0..1.
        forward_noise: standard deviation of a displacement, relative to it; 0..1.
        turn_noise: standard deviation of a turn, relative to it; 0..1.
        course_noise_rad: standard deviation of the course at each measurement; 0..1.
        target_speed_m_s: largest speed of a moving target, as a random walk.
        unknown_nt, unknown_m: standard deviation and correlation distance of anomalies of unknown shape.
        most_anomalies: number of anomalies that are kept; the least probable target is dropped first.
        report_s: interval of estimates during a pass; there is one after each pass too.
        seed: of the random numbers.

    Raises:
        ValueError: a value is out of its range.
    """

    targets: tuple[str, ...] = TARGETS
    false_anomalies: tuple[str, ...] = FALSE_ANOMALIES
    target_prior: float = 0.5
    particles: int = 4000
    roulette: bool = False
    interval_s: float = 1.0
    threshold_nt: float = 3.0
    noise_nt: float = 0.5
    map_error_nt: float | None = None
    shape_error: float = 0.04
    forward_noise: float = 0.02
    turn_noise: float = 0.02
    course_noise_rad: float = 0.02
    target_speed_m_s: float = 0.0
    unknown_nt: float = 12.0
    unknown_m: float = 120.0
    most_anomalies: int = 12
    report_s: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        classes = self.classes
        if not self.targets:
            raise ValueError(
                "targets names no class: there is nothing to identify; give one or more, such as "
                "target:gaussian:30:80:60"
            )
        require_positive(
            **named(self, "interval_s", "threshold_nt", "noise_nt", "unknown_nt", "unknown_m", "report_s")
        )
        require_not_negative(**named(self, "target_speed_m_s", "map_error_nt"))
        for name in ("shape_error", "forward_noise", "turn_noise", "course_noise_rad"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} {value:g} is not in 0..1")
        for of in classes:
            if isinstance(of, GaussianClass) and of.sought and abs(of.amplitude_nt) <= self.threshold_nt:
                raise ValueError(
                    f"amplitude_nt {of.amplitude_nt:g} of class {of.name} does not exceed threshold_nt "
                    f"{self.threshold_nt:g}: no pass would detect it; lower threshold_nt, or give the class "
                    "of a stronger target"
                )
        if not 0.0 < self.target_prior < 1.0:
            raise ValueError(f"target_prior {self.target_prior:g} is not between 0 and 1")
        if not 100 <= self.particles <= 1_000_000:
            raise ValueError(f"particles {self.particles} is not in 100..1000000")
        if self.seed < 0:
            raise ValueError(f"seed {self.seed} is not accepted; 0 or more is")
        if self.most_anomalies < 1:
            raise ValueError(f"most_anomalies {self.most_anomalies} is not accepted; 1 or more is")

    @property
    def classes(self) -> tuple[AnomalyClass, ...]:
        """The classes, those sought first."""
        found = (*classes_from(self.targets, sought=True), *classes_from(self.false_anomalies, sought=False))
        names = [of.name for of in found]
        if len(set(names)) != len(names):
            raise ValueError(f"the classes {', '.join(names)} do not all have a name of their own")
        return found

    @property
    def reach_m(self) -> float:
        """Distance from an anomaly within which measurements are about it."""
        return max(of.reach_m for of in self.classes)
