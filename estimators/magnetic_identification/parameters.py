"""Parameters of the identification of magnetic targets."""

from dataclasses import dataclass

from estimators.magnetic_identification.classes import AnomalyClass, GaussianClass, classes_from
from flightsim.foundation.options import Options, option

__all__ = ["IdentificationParameters"]


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationParameters(Options):
    """Parameters of `Identifier`.

    Raises:
        ValueError: a value is out of its range.
    """

    targets: tuple[str, ...] = option(
        ("target:gaussian:30:80:60",),
        metavar="NAME:FORM:...",
        help="Class that is sought: NAME:gaussian:NT:ALONG:ACROSS or NAME:dipole:NT:LEAST:MOST.",
    )
    false_anomalies: tuple[str, ...] = option(
        ("boat:dipole:15:50:150",), metavar="NAME:FORM:...", help="Known class that is not sought, likewise."
    )
    target_prior: float = option(
        0.5, above=0.0, below=1.0, help="Probability, before any measurement, that an anomaly is a target."
    )
    particles: int = option(
        4000,
        least=100,
        most=1_000_000,
        help="Number of particles of the paper's filter; a hypothesis has 15 % as many sources.",
    )
    roulette: bool = option(False, help="Resampling by the paper's roulette wheel instead of systematically.")
    interval_s: float = option(
        1.0, above=0.0, help="Time over which readings are averaged for a measurement (paper: 1 s)."
    )
    threshold_nt: float = option(
        3.0, above=0.0, help="Difference from the map beyond which a reading is an anomaly (paper: 1 nT)."
    )
    noise_nt: float = option(0.5, above=0.0, help="Standard deviation of a reading.")
    map_error_nt: float | None = option(
        None,
        least=0.0,
        varies="as the map states it, else 1",
        help="Standard deviation of the published map.",
    )
    shape_error: float = option(
        0.04, least=0.0, most=1.0, help="Error of a measurement relative to itself: no signature is exact."
    )
    forward_noise: float = option(
        0.02, least=0.0, most=1.0, help="Standard deviation of a displacement, relative to it."
    )
    turn_noise: float = option(
        0.02, least=0.0, most=1.0, help="Standard deviation of a turn, relative to it."
    )
    course_noise_rad: float = option(
        0.02, least=0.0, most=1.0, help="Standard deviation of the course at each measurement."
    )
    target_speed_m_s: float = option(0.0, least=0.0, help="Largest speed of a target that moves steadily.")
    unknown_nt: float = option(12.0, above=0.0, help="Standard deviation of anomalies of unknown shape.")
    unknown_m: float = option(
        120.0, above=0.0, help="Distance over which anomalies of unknown shape are alike."
    )
    most_anomalies: int = option(
        12, least=1, help="Number of anomalies that are kept; the least probable target is dropped first."
    )
    report_s: float = option(
        5.0, above=0.0, help="Interval of estimates during a pass; there is one after each pass too."
    )
    seed: int = option(0, least=0, help="Seed of the random numbers.")

    def check_together(self) -> None:
        _ = self.classes  # refuses texts that are no class
        if not self.targets:
            raise ValueError(
                "targets names no class: there is nothing to identify; give one or more, such as "
                "target:gaussian:30:80:60"
            )

    def require_detectable(self) -> None:
        """Raise ValueError for a class that no pass would detect: it is below the threshold."""
        for of in self.classes:
            if isinstance(of, GaussianClass) and of.sought and abs(of.amplitude_nt) <= self.threshold_nt:
                raise ValueError(
                    f"amplitude_nt {of.amplitude_nt:g} of class {of.name} does not exceed threshold_nt "
                    f"{self.threshold_nt:g}: no pass would detect it; lower threshold_nt, or give the class "
                    "of a stronger target"
                )

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
