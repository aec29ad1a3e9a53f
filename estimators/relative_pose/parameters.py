"""Parameters of the beliefs about the relative pose."""

from dataclasses import dataclass
from typing import Final, Literal

from flightsim.foundation.options import Options, option, other_default

_MOST: Final = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativePoseParameters(Options):
    """Noise, numbers and limits of the beliefs about a relative pose.

    Range and heading have the noise of the paper's study (section VII); the paper does not give the others.
    """

    range_sigma_m: float = option(3.0, above=0.0, help="Standard deviation of the slant range.")
    height_sigma_m: float = option(
        1.5, above=0.0, help="Standard deviation of the difference of both pressure altitudes."
    )
    heading_sigma_rad: float = option(
        0.0141, above=0.0, help="Standard deviation of the difference of both magnetic headings."
    )
    heading_bias_rad: float = option(
        0.0,
        least=0.0,
        help="Standard deviation of slow errors of the relative heading: hard iron, mounting, clocks.",
    )
    heading_bias_s: float = option(
        15.0, above=0.0, help="Correlation time of slow errors of the relative heading."
    )
    walk_m_sqrt_s: float = option(
        0.5,
        above=0.0,
        help="Standard deviation of the horizontal position that a second of motion adds, per axis.",
    )
    climb_walk_m_sqrt_s: float = option(
        1.0, above=0.0, help="Standard deviation of the height that a second of motion adds."
    )
    heading_walk_rad_sqrt_s: float = option(
        0.01, above=0.0, help="Standard deviation of the relative heading that a second adds, of both gyros."
    )
    particles: int = option(1000, least=10, most=_MOST, help="Number of particles of a converged pose.")
    start_particles: int = option(
        50_000,
        least=10,
        most=_MOST,
        help="Number of particles before: the first measurements leave some 6 % of them.",
    )
    resample_below: float = option(
        0.5, least=0.0, most=1.0, help="Share of effective particles below which they are resampled."
    )
    jitter: float = option(
        0.2, least=0.0, help="Noise of resampled particles over the belief's own (Musso et al. 2001)."
    )
    components: int = option(64, least=8, most=_MOST, help="Number of Gaussians around the first range.")
    seed: int = option(0, least=0, help="Seed of the random numbers of the particles.")
    reset_nis: float = option(
        4.0, above=0.0, help="Limit of the mean squared innovation of the range over its variance."
    )
    reset_after: float = option(50.0, least=1.0, help="Number of ranges over which that mean is taken.")
    apart_sigmas: float = option(
        2.0, above=0.0, help="Distance of two modes, in standard deviations of both."
    )
    converged_weight: float = option(
        0.95, least=0.0, most=1.0, help="Least weight of the mode of a converged pose."
    )
    converged_sigma_m: float = option(
        20.0, above=0.0, help="Largest horizontal standard deviation of a converged pose (paper: 20 m)."
    )

    def check_together(self) -> None:
        if self.start_particles < self.particles:
            raise ValueError(
                f"start_particles {self.start_particles} is fewer than particles {self.particles}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativePoseSettings(RelativePoseParameters):
    """Parameters of the estimator. Their noise is that of flights, whose errors are not white: magnetic
    headings inherit the errors of roll and pitch, airspeeds those of the pitot tube.
    """

    heading_sigma_rad: float = other_default(0.1)
    walk_m_sqrt_s: float = other_default(2.0)
    reset_nis: float = other_default(6.0)
    vehicle: int = option(
        1,
        least=1,
        most=255,
        help="System id of the aircraft in whose level frame the pose is: the handoff aircraft.",
    )
    other: int = option(2, least=1, most=255, help="System id of the other aircraft, the tracker.")
    belief: Literal["particles", "gaussians"] = option(
        "gaussians", help="Representation of the relative pose."
    )

    def check_together(self) -> None:
        if self.vehicle == self.other:
            raise ValueError(f"other = {self.other} is not accepted: it is the vehicle itself")
