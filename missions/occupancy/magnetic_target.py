"""What is true in the world of a magnetic search, and the mission does not know."""

from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticTarget(PlanOptions):
    """The target, and the boats and wrecks besides it."""

    place_ne_m: tuple[float, float] | None = option(
        None,
        name="target",
        metavar="NORTH,EAST",
        varies="drawn from `seed`",
        help="Place of the target, m from the map's home.",
    )
    absent: bool = option(
        False, name="no-target", help="Area without a target, with its boats and wrecks only."
    )
    amplitude_nt: float = option(30.0, help="Amplitude of the target's Gaussian anomaly.")
    sigma_along_m: float = option(
        80.0,
        above=0.0,
        name="sigma",
        metavar="ALONGxACROSS",
        separators="x,",
        lone="same",
        help="Standard deviation of the target's Gaussian anomaly, m, along x across.",
    )
    sigma_across_m: float = option(
        60.0, above=0.0, name="sigma", help="Standard deviation of the target's anomaly across."
    )
    moment_a_m2: float | None = option(
        None,
        above=0.0,
        replaces=("amplitude", "sigma"),
        help="Dipole moment of the target along the Earth's field, in place of a Gaussian.",
    )
    depth_m: float = option(
        10.0,
        least=-1000.0,
        most=1000.0,
        needs=("moment", ()),
        help="Depth of a target with a moment below home.",
    )
    false_count: int = option(
        0, least=0, most=100, name="false-anomalies", help="Number of boats and wrecks, drawn from `seed`."
    )
