"""Parameters of the beliefs about the relative pose."""

from dataclasses import dataclass, fields
from typing import Final

from flightsim.foundation.checks import (
    check_fields,
    require_not_negative,
    require_positive,
    require_probability,
)

_MOST: Final = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativePoseParameters:
    """Noise, numbers and limits of the beliefs about a relative pose.

    Range and heading have the noise of the paper's study (section VII); the paper does not give the others.

    Attributes:
        range_sigma_m: standard deviation of the slant range.
        height_sigma_m: of the difference of both pressure altitudes.
        heading_sigma_rad: of the difference of both magnetic headings (paper: 0.01 rad each).
        walk_m_sqrt_s: standard deviation of the horizontal relative position per axis that one second of
            motion adds: errors of both airspeeds, sideslip, differences of the wind.
        climb_walk_m_sqrt_s: the same vertically.
        heading_walk_rad_sqrt_s: the same of the relative heading, from both gyros.
        particles: number of particles of a converged pose.
        start_particles: number of particles before. The first measurements select by range, depth and
            heading, and leave some 6 % of the particles: too few of a thousand to cover all bearings.
        resample_below: share of effective particles below which they are resampled.
        jitter: standard deviation of the noise that resampled particles get, over the belief's own: of depth,
            heading and range. Copies that differ in nothing but the noise of later steps lose bearings before
            the range has decided between them (Musso, Oudjane and Le Gland 2001, "Improving regularised
            particle filters").
        components: number of Gaussians around the first range.
        seed: of the random numbers of the particles.
        reset_nis: limit of the mean squared innovation of the range over its predicted variance.
        reset_after: number of ranges over which that mean is taken.
        apart_sigmas: two groups are two modes when their distance is above this many standard deviations of
            both.
        converged_weight: least weight of the mode of a converged pose.
        converged_sigma_m: largest horizontal standard deviation of the mode of a converged pose (paper: the
            error "remains near or below 20 m").
    """

    range_sigma_m: float = 3.0
    height_sigma_m: float = 1.5
    heading_sigma_rad: float = 0.0141
    walk_m_sqrt_s: float = 0.5
    climb_walk_m_sqrt_s: float = 1.0
    heading_walk_rad_sqrt_s: float = 0.01
    particles: int = 1000
    start_particles: int = 50_000
    resample_below: float = 0.5
    jitter: float = 0.2
    components: int = 64
    seed: int = 0
    reset_nis: float = 4.0
    reset_after: float = 50.0
    apart_sigmas: float = 2.0
    converged_weight: float = 0.95
    converged_sigma_m: float = 20.0

    def __post_init__(self) -> None:
        own = {field.name for field in fields(RelativePoseParameters)}  # derived classes check theirs
        check_fields(
            self,
            require_positive,
            but={
                "resample_below": require_probability,
                "converged_weight": require_probability,
                "jitter": require_not_negative,
            },
            unchecked=("seed", *(field.name for field in fields(self) if field.name not in own)),
        )
        for name, least in (("particles", 10), ("start_particles", self.particles), ("components", 8)):
            if not least <= getattr(self, name) <= _MOST:
                raise ValueError(f"{name} = {getattr(self, name)} is not accepted: {least} to {_MOST} are")
        if self.reset_after < 1.0:
            raise ValueError(f"reset_after = {self.reset_after:g} is not accepted: a number from 1 is")
        if self.seed < 0:
            raise ValueError(f"seed = {self.seed} is not accepted: a number from 0 is")
